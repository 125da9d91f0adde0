"""``tfcompose up``: a robot, or a built plan, as running processes.

Build a robot and start it, or start a built plan. It prints which edges are live, owned by whom, and when the tree is
complete. Ctrl-C, SIGTERM and SIGHUP end everything. An edge that somebody publishes already is refused, with that
node's name.
"""

from __future__ import annotations

import os
import sys
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.cli.console import Console
from tfcompose.cli.options import DEFAULT_FILE, add_variant, not_negative, positive
from tfcompose.cli.terminal import UNREADABLE, coloured, complain, print_findings, read_text, unreadable
from tfcompose.diagnostic import RejectedError, finding
from tfcompose.planfile import read_plan
from tfcompose.ros.environment import child_environment, missing_ros
from tfcompose.run.preflight import commands_of, started_by_us
from tfcompose.run.supervisor import supervise

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace

    from tfcompose.diagnostic import Diagnostic
    from tfcompose.plan import Plan

PLAN = "plan.json"


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument("file", nargs="?", default=DEFAULT_FILE, metavar="FILE|PLAN", help="default: robot.yaml")
    add_variant(parser)
    parser.add_argument("-o", "--output", metavar="DIR", help="where to build; default: build/ROBOT")
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
    missing = missing_ros()
    if missing:
        print_findings([finding("TF901", missing, None)], sys.stderr)
        return 1
    file = Path(arguments.file) if is_plan else _built(arguments)
    if isinstance(file, int):
        return file
    try:
        plan = read_plan(read_text(str(file)), str(file))
    except RejectedError as error:
        print_findings(error.diagnostics, sys.stderr)
        return UNREADABLE if unreadable(error.diagnostics) else 1
    plan = _as_asked(plan, arguments)
    if plan.guard.mode == "off" and arguments.settle is not None:
        complain("the guard is off, so nobody looks before the start: leave out --settle")
        return UNREADABLE
    found = commands_of(plan, started_by_us(plan), file, os.environ, child_environment)[1]
    if found:
        print_findings([_with_profile(one, arguments) for one in found], sys.stderr)
        return 1
    console = Console(plan, sys.stdout, colour=coloured(sys.stdout))
    return supervise(plan, file, report=console, duration_s=arguments.duration)


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


def _as_asked(plan: Plan, arguments: Namespace) -> Plan:
    """Return the plan with what the command line says about the guard."""
    env = {}
    if arguments.guard:
        plan = replace(plan, guard=replace(plan.guard, mode=arguments.guard))
        env["TFCOMPOSE_GUARD"] = arguments.guard
    if arguments.settle is not None:
        env["TFCOMPOSE_SETTLE_S"] = str(arguments.settle)
    processes = tuple(
        replace(process, env=process.env | env) if process.kind == "guard" else process for process in plan.processes
    )
    return replace(plan, processes=processes)
