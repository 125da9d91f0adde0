"""Compare a robot file with what is published, live or in a bag.

Compare each edge of FILE (a robot, or a built plan.json) with the running tree or a bag: missing,
not declared, under another parent, with another value, on the wrong topic, silent, too slow, from
another publisher. Exit code 0 if all is as expected, 1 if not, 2 if a file or a bag cannot be
read. Frames inside a sensor that its driver publishes may be off by as much as a calibration moves
them; more is a warning.
"""

from __future__ import annotations

import sys
import time
from typing import TYPE_CHECKING

from tfcompose.cli.options import (
    DEFAULT_FILE,
    add_bag,
    add_for,
    add_format,
    add_tolerance,
    add_variant,
    settle_duration,
)
from tfcompose.cli.terminal import print_findings

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace

    from tfcompose.foundation.findings import Span
    from tfcompose.guard.verdict.verify import Verdict
    from tfcompose.model.plan import Plan


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument(
        "file",
        nargs="?",
        metavar="FILE|PLAN",
        help="default: the robot that runs in this ROS domain, or robot.yaml",
    )
    add_variant(parser)
    parser.add_argument(
        "--live", action="store_true", help="use the running tree (default unless --bag is given)"
    )
    add_bag(parser)
    add_for(parser, "observe the running tree for S seconds; default: 5")
    add_tolerance(parser)
    add_format(parser, "json", "junit")
    parser.add_argument(
        "--fail-on",
        choices=("error", "warning"),
        default="error",
        help="lowest severity that exits 1; default: error",
    )


def run(arguments: Namespace) -> int:
    """Verify; exit code 0 if all is as expected, 1 if not, 2 if something cannot be read."""
    from tfcompose.cli.live import observe, read_bag, refuse_live_bag
    from tfcompose.cli.plans import expected_plan
    from tfcompose.guard.verdict.verify import verify
    from tfcompose.model.plan.topics import parts_of
    from tfcompose.tf.live.edges import SETTLE_S, TreeObserver

    refuse_live_bag(arguments)
    settle_duration(arguments, 5.0, is_live=not arguments.bag)
    plan, places = _running_plan(arguments) or expected_plan(
        arguments.file or DEFAULT_FILE, arguments
    )
    settle_s = 0.0 if arguments.bag else SETTLE_S
    observers = {topics: TreeObserver(settle_s=settle_s) for topics in parts_of(plan)}
    # Programs get each missing edge; a robot without edges misses none.
    may_be_silent = arguments.format != "text" or not plan.edges
    begun = time.monotonic()
    if arguments.bag:
        read_bag(arguments.bag, observers, may_be_silent=may_be_silent)
    else:
        observe(
            "tfcompose_verify",
            observers,
            ros=plan.ros,
            duration_s=arguments.duration,
            may_be_silent=may_be_silent,
        )
    seconds = time.monotonic() - begun
    return _report(arguments, plan, verify(plan, observers, arguments.tolerance, places), seconds)


def _running_plan(arguments: Namespace) -> tuple[Plan, dict[str, Span]] | None:
    """Return the plan of the robot that runs in this ROS domain, without places.

    None if a file or a bag is given.
    """
    from tfcompose.cli.runs import plan_of_domain

    changed = arguments.profiles or arguments.overlays or arguments.settings or arguments.given
    if arguments.file or arguments.bag or changed:
        return None
    plan = plan_of_domain()
    return (plan, {}) if plan else None


def _report(arguments: Namespace, plan: Plan, verdicts: list[Verdict], seconds: float) -> int:
    """Print the verdicts and return the exit code."""
    failing = frozenset({"error"} if arguments.fail_on == "error" else {"error", "warning"})
    found = [one for verdict in verdicts for one in verdict.found]
    if arguments.format == "junit":
        from tfcompose.compiler.render.formats import render_junit

        cases = [
            (verdict.owner or "undeclared", verdict.edge, verdict.found) for verdict in verdicts
        ]
        sys.stdout.write(render_junit(plan.robot, cases, failing=failing, seconds=seconds))
    elif arguments.format == "json":
        from tfcompose.compiler.render.formats import render_json

        sys.stdout.write(render_json(found))
    else:
        from tfcompose.guard.verdict.verify import summary

        print_findings(found, sys.stdout)
        print(f"{plan.robot}: {summary(verdicts)}, in {arguments.bag or 'the running tree'}")
    return int(any(one.severity in failing for one in found))
