"""Units for systemd: one service for each process of a plan, and a target for the robot."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.export.supervisors import (
    MAX_RESTARTS,
    STOP_S,
    after,
    command_of,
    gaps_of,
    plain_name,
    plain_names,
    restart_of,
    started,
)
from tfcompose.files import File

if TYPE_CHECKING:
    from tfcompose.export.supervisors import Machine
    from tfcompose.plan import Plan, PlanProcess

#: Sources files, then becomes the command; bash, because ROS's setup files are bash's.
_SOURCING = 'for file in $0; do . "$file"; done; exec "$@"'


def systemd(plan: Plan, machine: Machine) -> tuple[tuple[File, ...], list[str]]:
    """Return the units, and what they do not keep of the plan.

    tfcompose's own processes say when they are ready (``Type=notify``), so that ``After=`` waits for that; of others
    systemd knows that they were executed. One that others wait for until it is done is ``Type=oneshot``.
    """
    target = f"{plain_name(plan.robot)}.target"
    awaited = {name for process in started(plan) for name, what in process.after.items() if what == "done"}
    units = [
        File(_unit(plan, process.name), _service(plan, process, machine, target, done=process.name in awaited))
        for process in started(plan)
    ]
    gaps = gaps_of(plan)
    for process in started(plan):
        for name, what in process.after.items():
            other = plan.process(name)
            if what == "ready" and other.kind == "run":
                gaps.append(f"{process.name} waits until {name} was executed: systemd cannot see that it is ready")
    return (File(target, _target(plan, [unit.path for unit in units])), *units), gaps


def _unit(plan: Plan, process: str) -> str:
    return f"{plain_name(plan.robot)}-{plain_names(plan)[process]}.service"


def _target(plan: Plan, units: list[str]) -> str:
    wanted = "\n".join(f"Wants={unit}" for unit in units)
    return (
        f"[Unit]\nDescription=Robot {plan.robot}\n"
        f"Wants=network-online.target\nAfter=network-online.target\n{wanted}\n\n"
        "[Install]\nWantedBy=default.target\n"
    )


def _service(plan: Plan, process: PlanProcess, machine: Machine, target: str, *, done: bool) -> str:
    before = [_unit(plan, name) for name in after(plan, process)]
    most = MAX_RESTARTS if process.max_restarts is None else process.max_restarts
    kind = "oneshot" if done else "exec" if process.kind == "run" else "notify"
    restart = restart_of(process)
    unit = [
        f"Description={_plain(process.name)} of robot {plan.robot}",
        f"PartOf={target}",
        *(f"{key}={' '.join(before)}" for key in ("After", "Wants") if before),
        *([] if restart == "no" else ["StartLimitIntervalSec=300", f"StartLimitBurst={most + 1}"]),
    ]
    service = [
        f"Type={kind}",
        *(["NotifyAccess=all", "TimeoutStartSec=60"] if kind == "notify" else []),
        *(f"Environment={_quoted(f'{name}={value}')}" for name, value in sorted(machine.env.items())),
        *_logs(plan, machine),
        f"WorkingDirectory={_plain(machine.folder)}",
        f"ExecStart={_exec(process, machine)}",
        f"Restart={'on-failure' if done and restart == 'always' else restart}",
        "RestartSec=1",
        f"KillSignal={process.stop.signal}",
        "KillMode=mixed",
        f"TimeoutStopSec={STOP_S if process.stop.timeout_s is None else process.stop.timeout_s:g}",
        f"SuccessExitStatus={process.stop.signal} 130",
    ]
    parts = (("Unit", unit), ("Service", service), ("Install", [f"WantedBy={target}"]))
    return "\n".join("\n".join([f"[{name}]", *lines, ""]) for name, lines in parts)


def _logs(plan: Plan, machine: Machine) -> list[str]:
    """Return where ROS logs to, unless that is set: no node starts without, and a system's service has no home."""
    if {"ROS_LOG_DIR", "ROS_HOME"} & machine.env.keys():
        return []
    folder = f"tfcompose/{plain_name(plan.robot)}"
    return [f"LogsDirectory={folder}", f"Environment=ROS_LOG_DIR=%L/{folder}"]


def _exec(process: PlanProcess, machine: Machine) -> str:
    words = command_of(process, machine.python, f"{machine.folder}/plan.json")
    if machine.setup:
        words = ["/bin/bash", "-c", _SOURCING, " ".join(machine.setup), *words]
    return " ".join(_quoted(word).replace("$", "$$") for word in words)


def _plain(text: str) -> str:
    return text.replace("%", "%%")


def _quoted(word: str) -> str:
    """Return the word as systemd reads it back; a percent sign is doubled."""
    text = _plain(word)
    if text and all(c.isalnum() or c in "/.:=@+,-_%" for c in text):
        return text
    escaped = text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
    return f'"{escaped}"'
