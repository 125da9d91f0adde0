"""How ``up`` starts a robot here: it checks first all that the plan needs, then makes the runtime directory."""

from __future__ import annotations

import os
import sys
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.cli.background import detach
from tfcompose.cli.console import Console, StatusLine, vanished
from tfcompose.cli.plans import PLAN, built_plan, copy_plan, is_plan, plan_to_start
from tfcompose.cli.reading import read_text
from tfcompose.cli.runs import complain_of_leftovers, hidden_run, request, since, wait_until_ready
from tfcompose.cli.terminal import FAILED, UNREADABLE, can_redraw, coloured, complain, fail, reject, size_of
from tfcompose.findings import RejectedError
from tfcompose.ipc import PlanChange, UpdateRequest
from tfcompose.launcher.control import listen
from tfcompose.launcher.logs import Logs
from tfcompose.launcher.output import NonBlockingOutput
from tfcompose.launcher.preflight import commands_of, started_by_us
from tfcompose.launcher.runtime_dir import Lock, RuntimeDirError, runtime_dir_of
from tfcompose.launcher.supervisor import Session, supervise
from tfcompose.ros.environment import child_environment, no_ros, ros_trouble

if TYPE_CHECKING:
    from argparse import Namespace

    from tfcompose.findings import Finding
    from tfcompose.launcher.runtime_dir import RuntimeDir
    from tfcompose.plan import Plan


def start(arguments: Namespace) -> int:
    """Build where that is needed, look at everything, and start; return the exit code as ``up`` does."""
    missing = no_ros()
    if missing:
        reject([missing])
    file = Path(arguments.file) if is_plan(arguments.file) else _build(arguments)
    plan = plan_to_start(built_plan(file), arguments)
    if plan.guard.mode == "off" and arguments.settle is not None:
        fail("the guard is off, so --settle has no effect: leave it out", UNREADABLE)
    trouble = ros_trouble(child_environment(os.environ, plan.ros, own=True))
    found = [trouble] if trouble else commands_of(plan, started_by_us(plan), file, os.environ, child_environment)[1]
    if found:
        reject([_with_profiles(one, arguments) for one in found])
    try:
        place = runtime_dir_of(plan, os.environ)
        lock = Lock(place)
    except RuntimeDirError as error:
        fail(str(error), UNREADABLE)
    except BlockingIOError:
        return _update(plan, file, place, arguments)
    except OSError as error:
        fail(f"the run cannot be recorded: {error}", UNREADABLE)
    with ExitStack() as stack:
        stack.callback(lock.close)
        if hidden := hidden_run(place):
            fail(hidden)
        copy = copy_plan(plan, file, place, alone=True)
        session = Session(copy, lock.run, file.absolute().parent, listen(place))
        if arguments.detach or arguments.wait:
            return detach(plan, place, lock, session, arguments)
        session.output = NonBlockingOutput(sys.stdout.fileno())
        stack.callback(session.output.close)
        return _run(plan, place, session, session.output, arguments.duration)


def _build(arguments: Namespace) -> Path:
    """Build the robot and return its plan's file."""
    from tfcompose.cli.building import build  # the compiler: a built plan needs none

    return build(arguments)[0] / PLAN


def _run(plan: Plan, place: RuntimeDir, session: Session, output: NonBlockingOutput, duration_s: float | None) -> int:
    """Run the plan on this terminal until it ends, and return the exit code."""
    logs = Logs(place.logs)
    status = StatusLine(plan, lambda: size_of(output.fd)[0]) if can_redraw(sys.stdout) else None
    console = Console(plan, output, colour=coloured(sys.stdout), keep=logs.write, status=status)
    session.refresh = console.refresh if status else None
    complain_of_leftovers(place, session.run_id)
    try:
        return supervise(plan, session.plan_file, report=console, duration_s=duration_s, session=session)
    finally:
        logs.close()


def _update(plan: Plan, file: Path, place: RuntimeDir, arguments: Namespace) -> int:
    """Bring the running robot to the plan; exit code 0, 1 where it runs as it is and was to be started here."""
    holder = place.holder()
    who = (
        f"{place.name} runs already: pid {holder.pid}, since {since(holder)}" if holder else f"{place.name} just ended"
    )
    copy = copy_plan(plan, file, place, alone=False)
    answer = request(place, UpdateRequest(str(copy), str(file.absolute().parent)), PlanChange)
    if answer is None:
        fail(who)
    parts = (("restarted", answer.changed), ("started", answer.added), ("stopped", answer.removed))
    changes = "; ".join(f"{word}: {', '.join(names)}" for word, names in parts if names)
    if changes:
        print(f"{who}; {changes}")
    else:
        complain(f"{who}; the plan is the same; tfcompose down stops it")
    if answer.held and changes:
        print(vanished(answer.held))
    if arguments.wait:
        return wait_until_ready(place, arguments.timeout)
    return 0 if changes or arguments.detach else FAILED


def _with_profiles(found: Finding, arguments: Namespace) -> Finding:
    """Return the finding; if programs are missing, with the profiles that can do without them."""
    if found.code != "TF810" or is_plan(arguments.file):
        return found
    profiles = _profiles_that_start(arguments)
    if not profiles:
        return found
    words = "".join(f" --profile {name}" for name in arguments.profiles)
    advice = f"to start without them: tfcompose up {arguments.file}{words} --profile {' or '.join(profiles)}"
    return replace(found, help="; ".join(filter(None, (found.help, advice))))


def _profiles_that_start(arguments: Namespace) -> list[str]:
    """Return the profiles with which, laid over those that were asked for, every program is there."""
    from tfcompose.language import profiles_in, with_includes
    from tfcompose.load import load

    try:
        source = with_includes(load(read_text(arguments.file), arguments.file), read_text)
        names = [name for name in profiles_in(source) if name not in arguments.profiles]
        return [name for name in names if _starts_with(name, arguments)]
    except RejectedError:
        return []


def _starts_with(profile: str, arguments: Namespace) -> bool:
    from tfcompose.cli.compiling import library, overlays_of
    from tfcompose.compile import compile_robot
    from tfcompose.emit.plan import plan_of

    profiles, overlays = [*arguments.profiles, profile], overlays_of(arguments)
    file, presets = arguments.file, library()
    compiled = compile_robot(read_text(file), file, presets, profiles, overlays=overlays, read=read_text)
    if compiled.robot is None or compiled.errors:
        return False
    plan = plan_of(compiled.robot)
    return not commands_of(plan, started_by_us(plan), Path(file), os.environ, child_environment)[1]
