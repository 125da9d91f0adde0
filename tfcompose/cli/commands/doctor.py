"""``tfcompose doctor``: what is wrong with the running tree, and what to do.

Listen to the running system for some seconds and say what is wrong: trees that nothing connects, loops, two publishers
of one edge, stamps that no lookup can bring together, low rates, frames that no listener can receive, a silent /clock,
missing joint states, settings by which nothing is heard. Each finding names the node and the numbers. It needs no robot
file; with one, or with a built plan, it knows also what is expected. Ctrl-C ends the look, and what was found is said.
"""

from __future__ import annotations

import gc
import os
import sys
from importlib import import_module
from typing import TYPE_CHECKING

from tfcompose.cli.edge_table import printable
from tfcompose.cli.expected import expected
from tfcompose.cli.looking import ended_early
from tfcompose.cli.options import add_variant, namespace, positive
from tfcompose.cli.terminal import UNREADABLE, complain, print_findings
from tfcompose.findings import finding
from tfcompose.observe.census import topics_below
from tfcompose.observe.seen import counted
from tfcompose.plan import RosSettings
from tfcompose.ros.environment import RosError, child_environment, no_ros, ros_trouble
from tfcompose.ros.stop import Stop
from tfcompose.ros.topics import parts_of

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace

    from tfcompose.findings import Finding
    from tfcompose.plan import Plan

#: So many trees are named by their roots.
MOST_ROOTS = 6


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument("file", nargs="?", metavar="FILE|PLAN", help="what is expected; default: nothing is")
    add_variant(parser)
    parser.add_argument(
        "--for", dest="duration", type=positive, default=5.0, metavar="S", help="look for S seconds; default: 5"
    )
    parser.add_argument("--namespace", type=namespace, metavar="NS", help="look at /NS/tf and /NS/tf_static")
    parser.add_argument("--format", choices=("text", "json"), default="text", help="default: text")


def run(arguments: Namespace) -> int:
    """Look and print the findings; exit code 0 where nothing is wrong, 1 with findings, 2 for wrong use."""
    missing = no_ros()
    if missing:
        return _say([missing], arguments, "")
    plan = _plan(arguments)
    if isinstance(plan, int):
        return plan
    gc.enable()  # it may be asked to look for hours
    os.environ.update(child_environment(os.environ, plan.ros if plan else RosSettings(), own=True))
    trouble = ros_trouble(os.environ)
    if trouble:
        return _say([trouble], arguments, "")
    with Stop() as stop:
        module = import_module("tfcompose.observe.doctor")
        try:
            found = module.examine(_expected(plan, arguments.namespace), arguments.duration, stop)
        except RosError as error:
            return _say([finding("TF901", str(error), None)], arguments, "")
        code = ended_early(found.seconds, arguments.duration, heard=bool(found.edges)) if stop.requested else None
    if code is not None:
        return code
    seen = f"{counted(found.edges, 'edge')} from {counted(found.nodes, 'node')}"
    seen += f" below {printable(', '.join(found.roots[:MOST_ROOTS]))}" if found.roots else ""
    code = _say(found.findings, arguments, f"looked for {found.seconds:.1f} s at {seen}")
    if found.edges and found.elsewhere and arguments.format == "text":
        words = import_module("tfcompose.observe.elsewhere").namespace_words(found.elsewhere)
        sys.stdout.write(f"there is TF on {', '.join(found.elsewhere[:MOST_ROOTS])} too: {words}\n")
    return code


def _say(found: list[Finding], arguments: Namespace, looked: str) -> int:
    """Print the findings and return the exit code."""
    if arguments.format == "json":
        sys.stdout.write(import_module("tfcompose.render.json").render_json(found))
        return int(bool(found))
    print_findings(found, sys.stdout)
    if looked:
        sys.stdout.write(f"{looked}: {_summary(found)}\n")
    return int(bool(found))


def _summary(found: list[Finding]) -> str:
    errors = sum(one.severity == "error" for one in found)
    counts = ((errors, "error"), (len(found) - errors, "warning"))
    return " and ".join(counted(n, word) for n, word in counts if n) or "nothing is wrong"


def _plan(arguments: Namespace) -> Plan | int | None:
    """Return the plan of the robot or the plan's file that was given, or the exit code after saying what is wrong."""
    file = arguments.file
    if file is None:
        if arguments.profiles or arguments.overlays or arguments.settings:
            complain("--profile, --overlay and --set are laid over a robot file: name one")
            return UNREADABLE
        return None
    known = expected(file, arguments)
    return known if isinstance(known, int) else known[0]


def _expected(plan: Plan | None, below: str | None) -> dict[tuple[str, str], Plan | None]:
    """Return the topics to look at, each pair with the part of the plan that is expected there."""
    asked = topics_below(below or "")
    if plan is None:
        return {asked: None}
    parts = parts_of(plan)
    return {asked: parts.get(asked, plan)} if below is not None else dict(parts) or {asked: plan}
