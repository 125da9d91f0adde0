"""Finds the command of each process, and checks before the start what the process requires.

A plan contains placeholders for values that only the starting machine knows. The comment at
``PROGRAM`` in ``tfcompose.model.plan.plan`` lists them. ``${executable:PACKAGE/NAME}`` is the
program ``lib/PACKAGE/NAME`` below a prefix in AMENT_PREFIX_PATH, otherwise NAME on the PATH.
``${launch:PACKAGE/FILE}`` is a launch file in PACKAGE's share folder. FILE is its name or
the end of its path. The search begins in the share folder itself and its folder ``launch``, and
continues in all folders below. A launch file starts as a single process: ``ros2 launch`` with a
wrapper around the file.
"""

from __future__ import annotations

import json
import os
import re
import shutil
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from tfcompose.foundation import procfs
from tfcompose.foundation.findings import Finding, Note, did_you_mean, finding
from tfcompose.foundation.hooks import run_hook
from tfcompose.foundation.tool import installed_tools
from tfcompose.launcher.child import ChildCommand
from tfcompose.launcher.fence import by_partition, find_not_remapped, remap_tf, way_of
from tfcompose.launcher.kernel_settings import check_settings
from tfcompose.launcher.program import HERE, without_current_folder
from tfcompose.model.plan import PROGRAM
from tfcompose.model.plan.components import load_request
from tfcompose.model.variables import REMAPPED
from tfcompose.tf.ros.environment import missing_composition

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from tfcompose.model.plan import Plan, PlanProcess, RosSettings

_PLACEHOLDER = re.compile(r"\$\{(plan|build_dir|params_file)\}")
_ROS_EXECUTABLE = re.compile(r"\$\{executable:([^/}]+)/([^/}]+)\}")
_LAUNCH = re.compile(r"\$\{launch:([^/}]+)/([^}]+)\}")
_OUTPUT = "OVERRIDE_LAUNCH_PROCESS_OUTPUT"
_WRAPPER = Path(__file__).absolute().with_name("launch_wrapper.py")
#: The variable with the launch file and its settings, which the wrapper reads.
LAUNCH = "TFCOMPOSE_LAUNCH"
_KINDS = ("*launch.py", "*launch.xml", "*launch.yaml", "*launch.yml")


class Environment(Protocol):
    """Returns the environment of a process; ``is_built_in``: it is a process of tfcompose."""

    def __call__(
        self, base: Mapping[str, str], ros: RosSettings, *, is_built_in: bool
    ) -> dict[str, str]:
        """Return the environment.

        Raises:
            RosError: if the plan's settings cannot be applied.
        """


def commands_of(  # noqa: PLR0913, PLR0917 (what a command is made of)
    plan: Plan,
    processes: Sequence[PlanProcess],
    plan_file: Path,
    base: Mapping[str, str],
    environment: Environment,
    build_folder: Path | None = None,
) -> tuple[dict[str, ChildCommand], list[Finding]]:
    """Return the command of each process, and findings. With findings, nothing may start.

    ``build_folder`` is the folder in which the plan was built, if ``plan_file`` is a copy.
    """
    folder = build_folder or plan_file.absolute().parent
    findings = [*_never_started(plan), *_check_by_tools(plan)]
    commands: dict[str, ChildCommand] = {}
    missing = []
    way = way_of(plan, base)
    if way == "remap":
        findings += find_not_remapped(plan)
        processes = [remap_tf(plan, process) for process in processes]
    findings += _not_loadable(plan, processes)
    for process in processes:
        if process.component:
            fill = partial(_fill, process=process, plan_file=plan_file, build_dir=folder)
            request = load_request(plan, process, fill, private=way == "remap")
            commands[process.name] = ChildCommand((), {}, folder, load=request)
            continue
        command = _command_of(process, plan.ros, (plan_file.absolute(), folder), base, environment)
        if isinstance(command, Finding):
            findings.append(command)
        elif isinstance(command, NotFound):
            missing.append(command)
        else:
            commands[process.name] = command
            findings += [] if command.missing else check_settings(process)
    if way == "partition":
        commands, wrong = by_partition(plan, commands, plan_file.absolute().parent)
        findings += wrong
    elif way == "remap":
        guards = {process.name for process in processes if process.kind == "guard"}
        commands |= {name: _with_mark(commands[name]) for name in guards & commands.keys()}
    if missing:
        findings.append(not_found(missing))
    return commands, list(dict.fromkeys(findings))


def _command_of(
    process: PlanProcess,
    ros: RosSettings,
    files: tuple[Path, Path],
    base: Mapping[str, str],
    environment: Environment,
) -> ChildCommand | NotFound | Finding:
    is_built_in = process.kind != "run"
    env = environment(base, ros, is_built_in=is_built_in) | own_env(process, *files)
    if process.argv[:1] == (PROGRAM,):
        env = without_current_folder(env)
    argv = fill_argv(process, *files)
    if not argv:
        return finding("TF902", f"the plan does not say how {process.name} is started", None)
    folder = folder_of(process, *files)
    if not is_built_in and not folder.is_dir():
        lost = f"the working directory {folder} of {process.name} does not exist"
        return (
            ChildCommand(argv, env, folder, missing=lost)
            if process.required is False
            else finding("TF810", lost, None)
        )
    command: ChildCommand | NotFound | Finding
    if _is_launch(argv[0]):
        launched = _launch_command(process, ros, argv, env)
        command = (
            ChildCommand(launched[0], env | launched[1], folder)
            if isinstance(launched, tuple)
            else launched
        )
    else:
        program = executable_of(process, argv[0], folder, env)
        command = (
            program
            if isinstance(program, NotFound)
            else ChildCommand((program, *argv[1:]), env, folder, is_built_in)
        )
    if isinstance(command, ChildCommand):
        command = replace(command, process=process)
        if process.prefix:
            runner = executable_of(process, process.prefix[0], folder, env)
            command = (
                replace(command, argv=(runner, *process.prefix[1:], *command.argv))
                if isinstance(runner, str)
                else runner
            )
    if isinstance(command, NotFound) and process.required is False:
        return ChildCommand(argv, env, folder, missing=not_found([command]).message)
    return command


def _check_by_tools(plan: Plan) -> Iterator[Finding]:
    """Yield findings of the tools that have a section or a command in the plan."""
    commands = {
        ("command", process.argv[1])
        for process in plan.managed
        if process.kind == "run" and process.argv[:1] == (PROGRAM,)
    }
    features = commands | {("key", name) for name in plan.sections}
    for tool in installed_tools().tools if features else ():
        if tool.preflight and not features.isdisjoint(tool.names()):
            findings = run_hook(tool.preflight, tool.name, None, plan)
            yield from [findings] if isinstance(findings, Finding) else findings


def _with_mark(guard: ChildCommand) -> ChildCommand:
    return replace(guard, env=guard.env | {REMAPPED: "1"})


def _never_started(plan: Plan) -> list[Finding]:
    """Return findings about start conditions that can never be met.

    Each such condition has its own finding. Processes that wait for each other share one.
    """
    processes = {process.name: process for process in plan.processes}
    findings = []
    for process in plan.processes:
        for name, what in process.after.items():
            if name not in processes:
                findings.append(
                    finding(
                        "TF902", f"{process.name} waits for {name}, which is not in the plan", None
                    )
                )
            elif what == "done" and processes[name].kind != "run":
                message = f"{process.name} waits until {name} is {what}, which never happens"
                findings.append(finding("TF902", message, None))
    waiting = {
        process.name: set(process.after) & set(processes)
        for process in plan.processes
        if process.kind != "guard"
    }
    while free := [name for name, awaited in waiting.items() if not awaited & set(waiting)]:
        for name in free:
            del waiting[name]
    if waiting:
        findings.append(finding("TF812", f"{', '.join(waiting)} wait for each other", None))
    return findings


def _not_loadable(plan: Plan, processes: Sequence[PlanProcess]) -> list[Finding]:
    """Return findings about components that containers cannot load."""
    names = [process.name for process in processes if process.component]
    if not names:
        return []
    if not any(process.kind == "guard" for process in plan.processes):
        return [
            finding("TF902", f"the plan has no guard, which would load {', '.join(names)}", None)
        ]
    trouble = missing_composition()
    return [trouble] if trouble else []


# Programs.


def folder_of(process: PlanProcess, plan_file: Path, build_dir: Path) -> Path:
    """Return the working directory of the process, absolute and without ``..``."""
    if process.cwd is None:
        return _here()
    return Path(os.path.normpath(build_dir / _fill(process.cwd, process, plan_file, build_dir)))


def _here() -> Path:
    """Return the working directory, or its former path if it was removed."""
    try:
        return Path.cwd()
    except FileNotFoundError:
        return Path(procfs.working_dir())


def fill_argv(
    process: PlanProcess, plan_file: Path, build_dir: Path | None = None
) -> tuple[str, ...]:
    """Return the process's ``argv``, with paths of this machine instead of placeholders.

    The placeholders ``${executable:…}`` and ``${launch:…}`` remain; they are resolved later.
    ``plan_file`` and ``build_dir`` must be absolute.
    """
    is_ours = process.argv[:1] == (PROGRAM,)
    start, argv = (HERE, process.argv[1:]) if is_ours else ((), process.argv)
    return (*start, *(_fill(argument, process, plan_file, build_dir) for argument in argv))


def own_env(
    process: PlanProcess, plan_file: Path, build_dir: Path | None = None
) -> dict[str, str]:
    """Return the variables that the plan sets for the process, with placeholders replaced."""
    return {
        name: _fill(value, process, plan_file, build_dir) for name, value in process.env.items()
    }


def _fill(text: str, process: PlanProcess, plan_file: Path, build_dir: Path | None = None) -> str:
    values = {
        "plan": str(plan_file),
        "build_dir": str(build_dir or plan_file.parent),
    }
    if process.params_file is not None:
        values["params_file"] = str(plan_file.parent / process.params_file)
    return _PLACEHOLDER.sub(lambda match: values.get(match[1], match[0]), text)


@dataclass(frozen=True, slots=True)
class NotFound:
    """A program or launch file that was not found, and the process that needs it."""

    process: str
    program: str
    #: Sentences about the places that were searched.
    places: tuple[str, ...]
    #: The value of PATH; empty if PATH was not searched.
    path: str = ""
    #: What the user can do.
    advice: tuple[str, ...] = ()


def not_found(missing: Sequence[NotFound]) -> Finding:
    """Return a single finding for all programs that were not found."""
    what = ", ".join(f"{program.program} of {program.process}" for program in missing)
    message = f"{len(missing)} executables were not found: {what}"
    if len(missing) == 1:
        message = f"the executable {what} was not found"
    places = dict.fromkeys(place for program in missing for place in program.places)
    paths = ["looked in the folders of PATH"] if any(program.path for program in missing) else []
    advice = dict.fromkeys(part for program in missing for part in program.advice if part)
    return finding(
        "TF810",
        message,
        None,
        notes=[Note(note) for note in (*places, *paths)],
        help="; ".join(advice),
    )


def executable_of(
    process: PlanProcess, argument: str, folder: Path, env: Mapping[str, str]
) -> str | NotFound:
    """Return the path of the program that ``argument`` names, or a NotFound.

    A relative path starts in ``folder``. A bare name is searched on the PATH in ``env``.
    """
    ros = _ROS_EXECUTABLE.fullmatch(argument)
    if ros:
        return _in_package(process, ros[1], ros[2], env)
    if "/" in argument:
        path = folder / argument
        if _can_run(path):
            return str(path)
        relative = f"${{file({argument})}} is relative to the robot file, wherever up is run from"
        advice = () if argument.startswith("/") else (relative,)
        return NotFound(process.name, argument, (_why_not(path),), advice=advice)
    path_variable = env.get("PATH", os.defpath)
    return shutil.which(argument, path=path_variable) or NotFound(
        process.name,
        argument,
        (),
        path_variable,
        (
            f"install {argument}, or write its path",
            f"a node of a package is run: {{package: …, executable: {argument}}}",
        ),
    )


def _in_package(
    process: PlanProcess, package: str, name: str, env: Mapping[str, str]
) -> str | NotFound:
    prefixes = [prefix for prefix in env.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if prefix]
    folders = [Path(prefix) / "lib" / package for prefix in prefixes]
    for folder in folders:
        if _can_run(folder / name):
            return str(folder / name)
    path_variable = env.get("PATH", os.defpath)
    on_path = shutil.which(name, path=path_variable)
    if on_path:
        return on_path
    notes = [_why_not(folder / name) for folder in folders] or [
        "AMENT_PREFIX_PATH names no folder"
    ]
    programs = [
        file.name for folder in folders if folder.is_dir() for file in sorted(folder.iterdir())
    ]
    otherwise = "source the setup file of your ROS installation first"
    if prefixes:
        debian = f"ros-{env.get('ROS_DISTRO', 'jazzy')}-{package.replace('_', '-')}"
        otherwise = (
            f"install the package {package} (on Ubuntu probably: sudo apt install {debian})"
        )
    advice = (did_you_mean(name, programs),) if programs else (otherwise,)
    return NotFound(process.name, f"{package}/{name}", tuple(notes), path_variable, advice)


def _can_run(path: Path) -> bool:
    return path.is_file() and os.access(path, os.X_OK)


def _why_not(path: Path) -> str:
    if path.is_file():
        return f"{path} may not be executed"
    return f"{path} is a folder" if path.is_dir() else f"{path} does not exist"


# Launch files.


def _is_launch(argument: str) -> bool:
    """Return whether the argument names a launch file."""
    return _LAUNCH.fullmatch(argument) is not None


def _launch_command(
    process: PlanProcess, ros: RosSettings, argv: tuple[str, ...], env: Mapping[str, str]
) -> tuple[tuple[str, ...], dict[str, str]] | NotFound | Finding:
    """Return the command and additional variables, or the reason why there is none."""
    parsed = _LAUNCH.fullmatch(argv[0])
    package, name = (parsed[1], parsed[2]) if parsed else ("", "")
    path = env.get("PATH", os.defpath)
    ros2 = shutil.which("ros2", path=path)
    if ros2 is None:
        advice = (
            "source the setup file of your ROS installation first",
            "ros2 launch comes with the package ros2launch",
        )
        return NotFound(process.name, f"ros2 (for launch {package}/{name})", (), path, advice)
    file = _find_launch_file(process, package, name, env)
    if isinstance(file, NotFound):
        return file
    arguments = dict(argument.split(":=", 1) for argument in argv[1:] if ":=" in argument)
    odd = [argument for argument in argv[1:] if ":=" not in argument]
    if odd:
        message = f"{process.name}: {odd[0]} is not a launch argument"
        return finding("TF902", message, None, help="give name: value, or name:=value")
    settings = {
        "file": str(file),
        "arguments": arguments,
        "namespace": ros.namespace if process.namespace is None else process.namespace,
        "remap": process.remap,
        "sim_time": ros.clock == "sim",
    }
    # By default, the launch log gets a node's output, and the screen only its stderr. ``both``
    # sends stdout there too.
    more = {LAUNCH: json.dumps(settings, sort_keys=True), _OUTPUT: env.get(_OUTPUT) or "both"}
    return (ros2, "launch", "--noninteractive", str(_WRAPPER)), more


def path_in_share(package: str, name: str, env: Mapping[str, str]) -> tuple[Path, str] | None:
    """Return a package's share folder, and the path from it to a launch file.

    Return None if no share folder of the package has the file.
    """
    for share in filter(Path.is_dir, _shares_of(package, env)):
        direct = [file for file in (share / name, share / "launch" / name) if file.is_file()]
        files = direct or sorted(share.rglob(name))
        if files:
            return share, files[0].relative_to(share).as_posix()
    return None


def _shares_of(package: str, env: Mapping[str, str]) -> list[Path]:
    """Return the possible share folders of a package, overlays first."""
    prefixes = env.get("AMENT_PREFIX_PATH", "").split(os.pathsep)
    return [Path(prefix) / "share" / package for prefix in prefixes if prefix]


def _find_launch_file(
    process: PlanProcess, package: str, name: str, env: Mapping[str, str]
) -> Path | NotFound:
    if path := path_in_share(package, name, env):
        return Path(*path)
    shares = _shares_of(package, env)
    present = [share for share in shares if share.is_dir()]
    files = sorted(
        {file.name for share in present for kind in _KINDS for file in share.rglob(kind)}
    )
    states = dict.fromkeys(present, f"has no {name}")
    notes = tuple(f"{share} {states.get(share, 'is not there')}" for share in shares)
    listed = f"it has {', '.join(files[:12])}" if files else f"install the package {package}"
    return NotFound(
        process.name,
        f"launch file {package}/{name}",
        notes or ("AMENT_PREFIX_PATH names no folder",),
        advice=(did_you_mean(name, files, listed),),
    )
