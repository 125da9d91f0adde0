"""``tfcompose up``: a robot, or a built plan, as running processes.

Build a robot and start it, or start a built plan. It prints which edges are live, owned by whom, and when the tree is
complete. Ctrl-C, SIGTERM and SIGHUP end everything. An edge that somebody publishes already is refused, with that
node's name. Where the robot runs already, a changed plan is followed: only what is different is restarted.
"""

from __future__ import annotations

import os
import sys
from contextlib import ExitStack
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.cli.console import Console
from tfcompose.cli.options import DEFAULT_FILE, add_variant, not_negative, positive
from tfcompose.cli.status import Status, columns_of
from tfcompose.cli.terminal import UNREADABLE, coloured, complain, print_findings, read_text, unreadable
from tfcompose.diagnostic import RejectedError, finding
from tfcompose.planfile import read_plan
from tfcompose.ros.environment import child_environment, missing_ros
from tfcompose.run.control import listen
from tfcompose.run.logs import Logs
from tfcompose.run.outlet import Outlet
from tfcompose.run.place import Lock, PlaceError, place_of
from tfcompose.run.preflight import commands_of, started_by_us
from tfcompose.run.supervisor import Session, supervise

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace

    from tfcompose.diagnostic import Diagnostic
    from tfcompose.plan import Plan
    from tfcompose.run.place import Place

PLAN = "plan.json"


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument("file", nargs="?", default=DEFAULT_FILE, metavar="FILE|PLAN", help="default: robot.yaml")
    add_variant(parser)
    parser.add_argument("-o", "--output", metavar="DIR", help="where to build; default: build/ROBOT")
    parser.add_argument("-d", "--detach", action="store_true", help="go on in the background; tfcompose ps, logs, down")
    parser.add_argument(
        "--wait", action="store_true",
        help="in the background, and return when every process is ready and every edge live",
    )  # fmt: skip
    parser.add_argument(
        "--timeout", type=positive, default=60.0, metavar="S",
        help="how long --wait waits; then exit code 1, and the robot goes on; default: 60",
    )  # fmt: skip
    parser.add_argument("--dry-run", action="store_true", help="print what would be started, and start nothing")
    parser.add_argument(
        "--guard", choices=("off", "watch"),
        help="off: say which edges are live, and judge nobody; default: what the robot says",
    )  # fmt: skip
    parser.add_argument(
        "--settle",
        type=not_negative,
        metavar="S",
        help="look for other publishers so long before the start; default: 1",
    )
    parser.add_argument(
        "--for", dest="duration", type=positive, metavar="S",
        help="end S seconds after the look before the start; exit 1 if the tree was not complete or an error was found",
    )  # fmt: skip


def run(arguments: Namespace) -> int:
    """Start the plan and return the exit code: 0 after a clean end, 1 after a failure or a finding, 2 unreadable."""
    is_plan = arguments.file.endswith(".json")
    if is_plan and (arguments.profiles or arguments.overlays or arguments.settings or arguments.output):
        complain("a built plan takes no --profile, --overlay, --set and --output: those are for building it")
        return UNREADABLE
    if arguments.dry_run:
        code: int = import_module("tfcompose.cli.dry_run").dry_run(arguments)
        return code
    missing = missing_ros()
    if missing:
        print_findings([finding("TF901", missing, None)], sys.stderr)
        return 1
    file = Path(arguments.file) if is_plan else _built(arguments)
    if isinstance(file, int):
        return file
    plan = plan_in(file)
    if isinstance(plan, int):
        return plan
    plan = as_asked(plan, arguments)
    if plan.guard.mode == "off" and arguments.settle is not None:
        complain("the guard is off, so nobody looks before the start: leave out --settle")
        return UNREADABLE
    found = commands_of(plan, started_by_us(plan), file, os.environ, child_environment)[1]
    if found:
        print_findings([_with_profile(one, arguments) for one in found], sys.stderr)
        return 1
    return _start(plan, file, arguments)


def plan_in(file: Path) -> Plan | int:
    """Return the plan in the file, or the exit code after saying what is wrong with it."""
    try:
        return read_plan(read_text(str(file)), str(file))
    except RejectedError as error:
        print_findings(error.diagnostics, sys.stderr)
        return UNREADABLE if unreadable(error.diagnostics) else 1


def as_asked(plan: Plan, arguments: Namespace) -> Plan:
    """Return the plan with what the command line says about the guard."""
    if arguments.guard:
        plan = replace(plan, guard=replace(plan.guard, mode=arguments.guard))
    if arguments.settle is None:
        return plan
    env = {"TFCOMPOSE_SETTLE_S": str(arguments.settle)}
    processes = tuple(
        replace(process, env=process.env | env) if process.kind == "guard" else process for process in plan.processes
    )
    return replace(plan, processes=processes)


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
        kept = import_module("tfcompose.cli.keeping").kept(plan, file, place, alone=True)
        if isinstance(kept, int):
            return kept
        session = Session(kept, lock.run, file.absolute().parent, listen(place))
        if arguments.detach or arguments.wait:
            return _in_the_background(plan, place, lock, session, arguments)
        output = Outlet(sys.stdout.fileno())
        stack.callback(output.close)
        colour = coloured(sys.stdout)
        status = Status(plan, lambda: columns_of(output.fd)) if colour else None
        return _attached(plan, place, session, output, status, arguments.duration)


def _attached(  # noqa: PLR0913, PLR0917 (called in one place)
    plan: Plan, place: Place, session: Session, output: Outlet, status: Status | None, duration_s: float | None
) -> int:
    logs = Logs(place.logs)
    console = Console(plan, output, colour=status is not None, keep=logs.write, status=status)
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


def _with_profile(found: Diagnostic, arguments: Namespace) -> Diagnostic:
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
    built = import_module("tfcompose.cli.build").build(arguments)
    if isinstance(built, int):
        return built
    folder: Path = built[0]
    return folder / PLAN
