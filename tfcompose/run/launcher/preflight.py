"""Before anything is started: everything about the plan that cannot work on this machine, all at once."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Protocol

from tfcompose.findings import Finding, finding
from tfcompose.ipc import REMAPPED
from tfcompose.run.launcher.command import Command
from tfcompose.run.launcher.executable import NotFound, executable_of, filled_in, folder_of, not_found, own_env
from tfcompose.run.launcher.fencing import by_partition, not_remapped, remapped, way_of
from tfcompose.run.launcher.launch_file import is_launch, launch_command

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from tfcompose.plan import Plan, PlanProcess, RosSettings


class Environment(Protocol):
    """What makes a process's environment; ``own`` says that the process is one of tfcompose's."""

    def __call__(self, base: Mapping[str, str], ros: RosSettings, *, own: bool) -> dict[str, str]:
        """Return the environment.

        Raises:
            RosError: if the plan's settings cannot be followed.
        """


def started_by_us(plan: Plan) -> list[PlanProcess]:
    """Return the processes that the launcher starts, in the plan's order."""
    return [process for process in plan.processes if process.kind != "external"]


def commands_of(  # noqa: PLR0913, PLR0917 (what a command is made of)
    plan: Plan,
    processes: list[PlanProcess],
    plan_file: Path,
    base: Mapping[str, str],
    environment: Environment,
    built_in: Path | None = None,
) -> tuple[dict[str, Command], list[Finding]]:
    """Return each process's command, and what is wrong; with anything wrong, nothing should be started.

    ``built_in`` is the folder that the plan was built in, where ``plan_file`` is a copy of it.
    """
    folder = built_in or plan_file.absolute().parent
    found = _never_started(plan)
    commands: dict[str, Command] = {}
    missing = []
    way = way_of(plan, base)
    if way == "remap":
        found += not_remapped(plan)
        processes = [remapped(plan, process) for process in processes]
    for process in processes:
        command = _command_of(process, plan.ros, (plan_file.absolute(), folder), base, environment)
        if isinstance(command, Finding):
            found.append(command)
        elif isinstance(command, NotFound):
            missing.append(command)
        else:
            commands[process.name] = command
    if way == "partition":
        commands, wrong = by_partition(plan, commands, plan_file.absolute().parent)
        found += wrong
    elif way == "remap":
        commands = {name: _told_of_remapping(plan, name, command) for name, command in commands.items()}
    if missing:
        found.append(not_found(missing))
    return commands, list(dict.fromkeys(found))


def _command_of(
    process: PlanProcess,
    ros: RosSettings,
    files: tuple[Path, Path],
    base: Mapping[str, str],
    environment: Environment,
) -> Command | NotFound | Finding:
    own = process.kind != "run"
    env = environment(base, ros, own=own) | own_env(process, *files)
    argv = filled_in(process, *files)
    if not argv:
        return finding("TF902", f"the plan does not say how {process.name} is started", None)
    folder = folder_of(process, *files)
    if not own and not folder.is_dir():
        lost = f"the folder {folder} that {process.name} runs in is not there"
        optional = process.required is False
        return Command(argv, env, folder, missing=lost) if optional else finding("TF810", lost, None)
    command: Command | NotFound | Finding
    if is_launch(argv[0]):
        launched = launch_command(process, ros, argv, env)
        command = Command(launched[0], env | launched[1], folder) if isinstance(launched, tuple) else launched
    else:
        program = executable_of(process, argv[0], folder, env)
        command = program if isinstance(program, NotFound) else Command((program, *argv[1:]), env, folder, own)
    if isinstance(command, NotFound) and process.required is False:
        return Command(argv, env, folder, missing=not_found([command]).message)
    return command


def _told_of_remapping(plan: Plan, name: str, command: Command) -> Command:
    if plan.process(name).kind != "guard":
        return command
    return replace(command, env=command.env | {REMAPPED: "1"})


def _never_started(plan: Plan) -> list[Finding]:
    """Return a finding for each process that waits for what cannot come."""
    known = {process.name: process for process in plan.processes}
    found = []
    for process in plan.processes:
        for name, what in process.after.items():
            if name not in known:
                found.append(finding("TF902", f"{process.name} waits for {name}, which is not in the plan", None))
            elif what not in _promises(known[name]):
                found.append(finding("TF902", f"{process.name} waits until {name} is {what}: that never comes", None))
    waiting = {process.name: set(process.after) & set(known) for process in plan.processes if process.kind != "guard"}
    while free := [name for name, others in waiting.items() if not others & set(waiting)]:
        for name in free:
            del waiting[name]
    if waiting:
        found.append(finding("TF812", f"{', '.join(waiting)} wait for each other", None))
    return found


def _promises(process: PlanProcess) -> tuple[str, ...]:
    return ("started", "ready", "done") if process.kind == "run" else ("started", "ready")
