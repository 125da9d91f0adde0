"""How ``up`` starts a robot here: what it needs is looked at first, all of it; then the run gets its place."""

from __future__ import annotations

import os
import sys
from contextlib import ExitStack
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.cli.built_plan import PLAN, as_asked, plan_in
from tfcompose.cli.console import Console
from tfcompose.cli.status import Status, columns_of
from tfcompose.cli.terminal import UNREADABLE, coloured, complain, draws, print_findings
from tfcompose.ros.environment import child_environment, no_ros, ros_trouble
from tfcompose.run.launcher.control import listen
from tfcompose.run.launcher.logs import Logs
from tfcompose.run.launcher.outlet import Outlet
from tfcompose.run.launcher.preflight import commands_of, started_by_us
from tfcompose.run.launcher.session import Session
from tfcompose.run.launcher.supervisor import supervise
from tfcompose.run.place import Lock, PlaceError, place_of

if TYPE_CHECKING:
    from argparse import Namespace

    from tfcompose.findings import Finding
    from tfcompose.plan import Plan
    from tfcompose.run.place import Place


def start(arguments: Namespace) -> int:
    """Build where that is needed, look at everything, and start; return the exit code as ``up`` does."""
    missing = no_ros()
    if missing:
        print_findings([missing], sys.stderr)
        return 1
    file = Path(arguments.file) if arguments.file.endswith(".json") else _built(arguments)
    if isinstance(file, int):
        return file
    plan = plan_in(file)
    if isinstance(plan, int):
        return plan
    plan = as_asked(plan, arguments)
    if isinstance(plan, int):
        return plan
    if plan.guard.mode == "off" and arguments.settle is not None:
        complain("the guard is off, so nobody looks before the start: leave out --settle")
        return UNREADABLE
    trouble = ros_trouble(child_environment(os.environ, plan.ros, own=True))
    found = [trouble] if trouble else commands_of(plan, started_by_us(plan), file, os.environ, child_environment)[1]
    if found:
        print_findings([_with_profile(one, arguments) for one in found], sys.stderr)
        return 1
    return _start(plan, file, arguments)


def _start(plan: Plan, file: Path, arguments: Namespace) -> int:
    """Start the plan, or bring a robot that runs to it."""
    try:
        place = place_of(plan, os.environ)
        lock = Lock(place)
    except PlaceError as error:
        complain(str(error))
        return UNREADABLE
    except BlockingIOError:
        code: int = import_module("tfcompose.cli.again").up_again(plan, file, place, arguments)
        return code
    except OSError as error:
        complain(f"the run cannot be written down: {error}")
        return UNREADABLE
    with ExitStack() as stack:
        stack.callback(lock.close)
        keeping = import_module("tfcompose.cli.keeping")
        if elsewhere := keeping.runs_elsewhere(place):
            complain(elsewhere)
            return 1
        kept = keeping.kept(plan, file, place, alone=True)
        if isinstance(kept, int):
            return kept
        session = Session(kept, lock.run, file.absolute().parent, listen(place))
        if arguments.detach or arguments.wait:
            return _in_the_background(plan, place, lock, session, arguments)
        output = Outlet(sys.stdout.fileno())
        stack.callback(output.close)
        status = Status(plan, lambda: columns_of(output.fd)) if draws(sys.stdout) else None
        return _attached(plan, place, session, output, status, arguments.duration)


def _attached(  # noqa: PLR0913, PLR0917 (called in one place)
    plan: Plan, place: Place, session: Session, output: Outlet, status: Status | None, duration_s: float | None
) -> int:
    logs = Logs(place.logs)
    console = Console(plan, output, colour=coloured(sys.stdout), keep=logs.write, status=status)
    session.outlet, session.refresh = output, console.refresh if status else None
    for line in import_module("tfcompose.cli.keeping").left_behind(place, session.run_id):
        complain(line)
    try:
        return supervise(plan, session.plan_file, report=console, duration_s=duration_s, session=session)
    finally:
        logs.close()


def _in_the_background(plan: Plan, place: Place, lock: Lock, session: Session, arguments: Namespace) -> int:
    code: int = import_module("tfcompose.cli.detach").detach(plan, place, lock, session, arguments)
    return code


def _with_profile(found: Finding, arguments: Namespace) -> Finding:
    """Return the finding; if programs are missing, with the profiles that can do without them."""
    if found.code != "TF810" or arguments.file.endswith(".json"):
        return found
    profiles = import_module("tfcompose.cli.standing_in").profiles_that_start(arguments)
    if not profiles:
        return found
    words = "".join(f" --profile {name}" for name in arguments.profiles)
    advice = f"without them: tfcompose up {arguments.file}{words} --profile {' or '.join(profiles)}"
    return replace(found, help="; ".join(filter(None, (found.help, advice))))


def _built(arguments: Namespace) -> Path | int:
    """Build the robot and return its plan's file; the compiler is loaded only here."""
    built = import_module("tfcompose.cli.building").build(arguments)
    if isinstance(built, int):
        return built
    folder: Path = built[0]
    return folder / PLAN
