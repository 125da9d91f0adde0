"""Export for systemd and Docker Compose: a unit or a service for each process.

``kubernetes`` uses the first part of this module too: names, start order, restarts, probes and the
YAML writer.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from itertools import chain, count
from typing import TYPE_CHECKING, Any

import yaml

from tfcompose.launcher.program import anywhere
from tfcompose.model.files import File
from tfcompose.model.plan.middleware import middleware_variables
from tfcompose.model.process_keys import PROCESS_KEYS, Exported
from tfcompose.model.systemd import quote, source_then_run, without_specifiers

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Mapping

    from tfcompose.model.plan import Plan, PlanProcess
    from tfcompose.model.process_keys import Dialect, Setting


_SYSTEMD = tuple(key.systemd for key in PROCESS_KEYS)
_COMPOSE = tuple(key.compose for key in PROCESS_KEYS)

_NO_NAME = re.compile(r"[^A-Za-z0-9_.]+")


@dataclass(frozen=True, slots=True)
class Machine:
    """Folders and files on the machine that runs the exported files."""

    #: The plan's folder: absolute or, for compose only, relative to the written file.
    folder: str
    python: str = "python3"
    #: Setup files to source, in order.
    setup: tuple[str, ...] = ()
    env: dict[str, str] = field(default_factory=dict)
    image: str = ""


def plain_name(name: str) -> str:
    """Return the name without characters that units and services do not allow."""
    return _NO_NAME.sub("-", name)


def plain_names(plan: Plan, plain_of: Callable[[str], str] = plain_name) -> dict[str, str]:
    """Return a plain name for each process, by the name of the process.

    Plain names are unique. A name that is already plain does not change.
    """
    return distinct([process.name for process in plan.processes], plain_of)


def distinct(names: Collection[str], plain_of: Callable[[str], str]) -> dict[str, str]:
    """Return a plain name for each name.

    Plain names are unique. A name that is already plain does not change.
    """
    made = {name: name for name in names if plain_of(name) == name}
    names_in_use = set(made)
    for name in names:
        if name not in made:
            plain = plain_of(name)
            candidates = chain([plain], (f"{plain}-{number}" for number in count(2)))
            made[name] = next(
                candidate for candidate in candidates if candidate not in names_in_use
            )
            names_in_use.add(made[name])
    return made


def command_of(process: PlanProcess, python: str, plan_file: str) -> list[str]:
    """Return the command that starts the process as ``tfcompose up`` does."""
    return [*anywhere(python), "exec", plan_file, process.name]


def exported_processes(plan: Plan) -> dict[str, Exported]:
    """Return the processes as another supervisor starts them, by name."""
    awaited = {
        name for process in plan.started for name, what in process.after.items() if what == "done"
    }
    return {process.name: Exported(process, process.name in awaited) for process in plan.processes}


def settings_of(dialects: Iterable[Dialect], exported: Exported) -> list[Setting]:
    """Return another supervisor's settings for the keys of a process."""
    return [setting for dialect in dialects for setting in dialect.settings(exported)]


def after(plan: Plan, process: PlanProcess) -> dict[str, str]:
    """Return the processes that must start before this process, each with its condition.

    A strict guard is one of these processes. A component counts as its container.
    """
    waits: dict[str, str] = {}
    for name, what in process.after.items():
        component = plan.process(name).component
        if component and plan.process(component.container).kind != "external":
            waits.setdefault(component.container, "started")
        elif not component and plan.process(name).kind != "external":
            waits[name] = what
    guards = [
        process.name
        for process in plan.started
        if process.kind == "guard" and plan.guard.mode == "strict"
    ]
    return dict.fromkeys(() if process.kind == "guard" else guards, "started") | waits


def waiting_s(process: PlanProcess, what: str) -> float:
    """Return the time in seconds from a process's start until it is ready; 0 if unknown."""
    ready = process.ready
    return ready.number if what == "ready" and ready and ready.kind == "time" else 0.0


def gaps_of(plan: Plan, dialects: Collection[Dialect]) -> list[str]:
    """Return a sentence for each property of the plan that a supervisor without ROS loses.

    ``dialects`` translate the keys of a process for this supervisor.
    """
    exported = exported_processes(plan)
    gaps = []
    if plan.guard.on_violation != "report":
        gaps.append(f"the guard only reports, without on_violation: {plan.guard.on_violation}")
    if plan.guard.mode == "strict":
        gaps.append(
            "the fence uses remappings; latched messages before a sender's last one are lost when"
            " the guard exits"
        )
    for process in plan.processes:
        if process.kind == "external":
            gaps.append(f"{process.name} is external: start it yourself")
        for dialect in dialects:
            gaps += dialect.gaps(exported[process.name])
        component = process.component
        for name in process.after:
            if component and name != component.container:
                gaps.append(
                    f"{process.name} does not wait for {name}: the guard loads it once"
                    f" {component.container} runs"
                )
            elif not component and (awaited := plan.process(name).component):
                gaps.append(
                    f"{process.name} waits for the container {awaited.container}, but not for"
                    f" {name} in it"
                )
    return gaps


#: The container engine runs a probe without the image's entry point, so the probe must source the
#: setup file itself.
_SOURCED = (
    'setup=/opt/ros/${ROS_DISTRO:-RELEASE}/setup.sh; [ ! -f "$setup" ] || . "$setup"; exec "$@"'
)


def probe_of(plan: Plan, process: PlanProcess) -> list[str]:
    """Return the command that succeeds while the process's first edge is live.

    The command checks only the first edge, because each check is a process that joins the ROS
    domain.
    """
    edge = plan.edges_of(process.name)[0]
    argv = [
        *anywhere("python3"),
        "echo",
        edge.parent,
        edge.child,
        "--once",
        "--timeout",
        "5",
    ]
    namespace = process.topics[0].removesuffix("/tf")
    sourced = _SOURCED.replace("RELEASE", plan.ros.distro or "jazzy")
    return ["sh", "-c", sourced, "sh", *argv, *(["--namespace", namespace] if namespace else [])]


def outside_of(plan: Plan, folder: str) -> list[str]:
    """Return a sentence for each requirement that is not in the plan's folder."""
    gaps = []
    for process in plan.started:
        outside = [argument for argument in process.texts if "${build_dir}/.." in argument]
        gaps += [
            f"{process.name} needs {argument}, which is outside of {folder}: add a volume"
            for argument in outside
        ]
    return gaps


class _Dumper(yaml.SafeDumper):
    """Writes YAML, and quotes each string that YAML 1.1 or 1.2 could read as another type."""

    def ignore_aliases(self, data: object) -> bool:
        """Write repeated values in full, without YAML aliases."""
        del data
        return True

    def increase_indent(self, flow: bool = False, indentless: bool = False) -> None:  # noqa: FBT001, FBT002 (PyYAML's)
        """Indent lists below their keys."""
        del indentless
        super().increase_indent(flow, indentless=False)


#: Strings that no version of YAML reads as a number, a date, a truth value or null.
_UNQUOTED = re.compile(
    r"(?!(?:y|n|yes|no|on|off|true|false|null|inf|nan)\Z)[A-Za-z/][A-Za-z0-9_./-]*", re.IGNORECASE
)


def _string(dumper: yaml.SafeDumper, text: str) -> yaml.ScalarNode:
    style = "|" if "\n" in text else None if _UNQUOTED.fullmatch(text) else '"'
    return dumper.represent_scalar("tag:yaml.org,2002:str", text, style)


_Dumper.add_representer(str, _string)


def yaml_text(value: Mapping[str, Any]) -> str:
    """Return the value as block-style YAML, keys in their order."""
    return yaml.dump(value, Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=1000)


def systemd(plan: Plan, machine: Machine) -> tuple[tuple[File, ...], list[str]]:
    """Return the units, and a sentence for each property of the plan that they do not keep.

    tfcompose's own processes notify systemd when they are ready (``Type=notify``), so ``After=``
    waits for that. For other processes, systemd only knows that it has executed the program. If
    other processes wait until a process is done, its unit has ``Type=oneshot``. If a process is
    ready a fixed time after its start, the unit sleeps for this time before systemd considers the
    unit started.
    """
    exported = exported_processes(plan)
    names = {
        name: f"{plain_name(plan.robot)}-{plain}.service"
        for name, plain in plain_names(plan).items()
    }
    units = [
        File(
            names[process.name],
            _unit_text(plan, exported[process.name], machine, names),
        )
        for process in plan.started
    ]
    gaps = gaps_of(plan, _SYSTEMD)
    for process in plan.started:
        for name, what in process.after.items():
            awaited = plan.process(name)
            if what == "ready" and awaited.kind == "run" and not waiting_s(awaited, what):
                gaps.append(
                    f"{process.name} waits only until {name} was executed: systemd cannot tell"
                    " when it is ready"
                )
            if what == "started" and _settling_s(plan, awaited):
                gaps.append(f"{process.name} waits until {name} is ready, not only started")
    return (File(_target_name(plan), _target(plan, [unit.path for unit in units])), *units), gaps


def _target_name(plan: Plan) -> str:
    return f"{plain_name(plan.robot)}.target"


def _target(plan: Plan, units: list[str]) -> str:
    wants = "\n".join(f"Wants={unit}" for unit in units)
    return (
        f"[Unit]\nDescription=Robot {plan.robot}\n"
        f"Wants=network-online.target\nAfter=network-online.target\n{wants}\n\n"
        "[Install]\nWantedBy=default.target\n"
    )


def _settling_s(plan: Plan, process: PlanProcess) -> float:
    """Return for how many seconds after its start other processes wait for this process."""
    name = process.name
    return max(
        (
            waiting_s(process, waiting.after[name])
            for waiting in plan.started
            if name in waiting.after
        ),
        default=0.0,
    )


def _unit_text(plan: Plan, exported: Exported, machine: Machine, names: Mapping[str, str]) -> str:
    """Return the unit of a process; ``names`` are the names of all units, by process."""
    process = exported.process
    target = _target_name(plan)
    before = [names[name] for name in after(plan, process)]
    kind = "oneshot" if exported.awaited else "exec" if process.kind == "run" else "notify"
    settling_s = _settling_s(plan, process)
    settings = settings_of(_SYSTEMD, exported)
    unit = [
        f"Description={without_specifiers(process.name)} of robot {plan.robot}",
        f"PartOf={target}",
        *(f"{key}={' '.join(before)}" for key in ("After", "Wants") if before),
        *(f"{key}={value}" for key, value, section in settings if section == "Unit"),
    ]
    service = [
        f"Type={kind}",
        *(["NotifyAccess=all"] if kind == "notify" else []),
        *([f"TimeoutStartSec={60 + settling_s:g}"] if kind == "notify" or settling_s else []),
        *(
            f"Environment={quote(f'{name}={value}')}"
            for name, value in sorted(machine.env.items())
        ),
        *_logs(plan, machine),
        f"WorkingDirectory={without_specifiers(machine.folder)}",
        f"ExecStart={_exec(process, machine)}",
        *([f"ExecStartPost=/bin/sleep {settling_s:g}"] if settling_s else []),
        *(f"{key}={value}" for key, value, section in settings if section == "Service"),
    ]
    parts = (("Unit", unit), ("Service", service), ("Install", [f"WantedBy={target}"]))
    return "\n".join("\n".join([f"[{name}]", *lines, ""]) for name, lines in parts)


def _logs(plan: Plan, machine: Machine) -> list[str]:
    """Return the settings for ROS's log folder, unless the plan sets the folder.

    No ROS node starts without a log folder, and a system service has no home folder.
    """
    if {"ROS_LOG_DIR", "ROS_HOME"} & machine.env.keys():
        return []
    folder = f"tfcompose/{plain_name(plan.robot)}"
    return [f"LogsDirectory={folder}", f"Environment=ROS_LOG_DIR=%L/{folder}"]


def _exec(process: PlanProcess, machine: Machine) -> str:
    argv = source_then_run(
        machine.setup, command_of(process, machine.python, f"{machine.folder}/plan.json")
    )
    return " ".join(quote(argument).replace("$", "$$") for argument in argv)


#: The path of the plan's folder inside a container.
INSIDE = "/robot"
IMAGE = "${TFCOMPOSE_IMAGE:?set it to an image with ROS 2 Jazzy and tfcompose}"
_MET = {
    "started": "service_started",
    "ready": "service_healthy",
    "done": "service_completed_successfully",
}


def compose(plan: Plan, machine: Machine) -> tuple[tuple[File, ...], list[str]]:
    """Return the compose file, and a sentence for each property of the plan that it loses.

    A process that owns edges is healthy while its first edge is live; ``after: ready`` waits until
    the process is healthy. A process with ``host`` is in the Compose profile of that name, and
    waits only for processes on the same host.
    """
    names = plain_names(plan)
    exported = exported_processes(plan)
    services = {
        names[process.name]: _compose_service(plan, exported[process.name], machine, names)
        for process in plan.started
    }
    gaps = gaps_of(plan, _COMPOSE)
    for process in plan.started:
        for name, what in process.after.items():
            awaited = plan.process(name)
            if what == "ready" and awaited.kind != "external" and not plan.edges_of(name):
                gaps.append(
                    f"{process.name} waits only until {name} was started: compose cannot tell"
                    " when it is ready"
                )
            if awaited.kind != "external" and _profile(plan, awaited) not in (
                None,
                _profile(plan, process),
            ):
                gaps.append(f"{process.name} does not wait for {name}, which is on {awaited.host}")
    text = yaml_text({"name": plain_name(plan.robot), "services": services})
    return (File("compose.yaml", text),), gaps + outside_of(plan, INSIDE)


def _profile(plan: Plan, process: PlanProcess) -> str | None:
    """Return the Compose profile of a service.

    This is the host of the process. It is None if the plan contains only the processes of a single
    host.
    """
    return plain_name(process.host) if process.host and plan.host is None else None


def _compose_service(
    plan: Plan, exported: Exported, machine: Machine, names: Mapping[str, str]
) -> dict[str, Any]:
    """Return the service of a process; ``names`` are the names of all services, by process."""
    process = exported.process
    profile = _profile(plan, process)
    waits = {
        name: what
        for name, what in after(plan, process).items()
        if _profile(plan, plan.process(name)) in (None, profile)
    }
    domain = "${ROS_DOMAIN_ID:-0}" if plan.ros.domain_id is None else str(plan.ros.domain_id)
    service: dict[str, Any] = {
        **({"profiles": [profile]} if profile else {}),
        "image": machine.image or IMAGE,
        "network_mode": "host",
        "ipc": "host",
        "init": True,
        "command": [
            _escape(argument) for argument in command_of(process, "python3", f"{INSIDE}/plan.json")
        ],
        "environment": {"ROS_DOMAIN_ID": domain, **_discovery(plan)},
        "volumes": [
            {"type": "bind", "source": machine.folder, "target": INSIDE, "read_only": True}
        ],
        "working_dir": INSIDE,
        **{key: value for key, value, _ in settings_of(_COMPOSE, exported)},
    }
    if waits:
        service["depends_on"] = {}
        for name, what in waits.items():
            is_known = what != "ready" or bool(plan.edges_of(name))
            condition = _MET[what if is_known else "started"]
            service["depends_on"][names[name]] = {"condition": condition}
    if plan.edges_of(process.name):
        test = ["CMD", *map(_escape, probe_of(plan, process))]
        service["healthcheck"] = {
            "test": test,
            "interval": "10s",
            "timeout": "8s",
            "start_period": "30s",
            "retries": 3,
        }
    return service


def _discovery(plan: Plan) -> dict[str, str]:
    """Return the environment variables that the health check needs.

    The process itself gets these variables from the plan.
    """
    discovery = (
        {"ROS_AUTOMATIC_DISCOVERY_RANGE": plan.ros.discovery.upper()} if plan.ros.discovery else {}
    )
    return discovery | middleware_variables(plan.ros, {})


def _escape(text: str) -> str:
    """Escape the text, because Compose replaces ``$NAME`` by variables."""
    return text.replace("$", "$$")
