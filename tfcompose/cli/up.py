"""``tfcompose up``: a robot, or a built plan, as running processes.

Build a robot and start it, or start a built plan. It prints which edges are live, owned by whom, and when the tree is
complete. Ctrl-C, SIGTERM and SIGHUP end everything. An edge that somebody publishes already is refused, with that
node's name. Where the robot runs already, a changed plan is followed: only what is different is restarted.
"""

from __future__ import annotations

import os
import sys
from importlib import import_module
from typing import TYPE_CHECKING

from tfcompose.cli.options import DEFAULT_FILE, add_variant, not_negative, positive
from tfcompose.cli.terminal import UNREADABLE, complain, print_findings, read_text, unreadable
from tfcompose.diagnostic import RejectedError
from tfcompose.frozen import replace
from tfcompose.plan import Plan
from tfcompose.plan.file import read_plan
from tfcompose.run.hosts import share_of

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace
    from pathlib import Path

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
    parser.add_argument(
        "--host", metavar="NAME",
        help="start the share of this host, and expect the others'; default: this machine's name, if the robot has it",
    )  # fmt: skip
    parser.add_argument("--dry-run", action="store_true", help="print what would be started, and start nothing")
    parser.add_argument(
        "--guard", choices=("off", "watch", "strict"),
        help="off: say which edges are live, and judge nobody; strict: hold back what a process does not own; "
        "default: what the robot says",
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
    part, name = ("dry_run", "dry_run") if arguments.dry_run else ("starting", "start")
    code: int = getattr(import_module(f"tfcompose.cli.{part}"), name)(arguments)
    return code


def plan_in(file: Path) -> Plan | int:
    """Return the plan in the file, or the exit code after saying what is wrong with it."""
    try:
        return read_plan(read_text(str(file)), str(file))
    except RejectedError as error:
        print_findings(error.diagnostics, sys.stderr)
        return UNREADABLE if unreadable(error.diagnostics) else 1


def as_asked(plan: Plan, arguments: Namespace) -> Plan | int:
    """Return this machine's share of the plan, with what the command line says about the guard; or an exit code."""
    if arguments.guard:
        plan = replace(plan, guard=replace(plan.guard, mode=arguments.guard))
    share = share_of(plan, arguments.host, os.uname().nodename)
    if not isinstance(share, Plan):
        print_findings([share], sys.stderr)
        return 1
    plan = share
    if arguments.settle is None:
        return plan
    env = {"TFCOMPOSE_SETTLE_S": str(arguments.settle)}
    processes = tuple(
        replace(process, env=process.env | env) if process.kind == "guard" else process for process in plan.processes
    )
    return replace(plan, processes=processes)
