"""Compare a robot file with the published tree, live or in a bag.

Compare each edge of FILE (a robot, or a built plan.json) with the running tree or a bag: missing,
not declared, under another parent, with another value, on the wrong topic, silent, too slow, from
another publisher. Exit 0 if all edges are as expected, 1 if not, 2 if a file or a bag cannot be
read. If a driver publishes the frames inside its sensor, they may be off by a calibration; a
larger deviation is a warning.
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
    changes_robot,
    settle_duration,
)
from tfcompose.cli.terminal import fail, print_findings, warn

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace
    from collections.abc import Mapping

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
        "--running",
        action="store_true",
        help="expect the edges of the robot that runs in this ROS domain; fail if none runs",
    )
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
    """Verify. Return 0 if everything is as expected, 1 if not, 2 if something cannot be read."""
    from tfcompose.cli.live import observe_topics, recording_day, refuse_live_bag
    from tfcompose.cli.plans import expected_plan
    from tfcompose.guard.verdict.verify import verify
    from tfcompose.model.plan.topics import joint_states_topics, parts_of

    refuse_live_bag(arguments)
    settle_duration(arguments, 5.0, is_live=not arguments.bag)
    plan, places = _running_plan(arguments) or expected_plan(
        arguments.file or DEFAULT_FILE, arguments, recording_day(arguments.bag)
    )
    running = other_plan(arguments, plan)
    _warn_of_adjustments(arguments, plan)
    # Programs get each missing edge; a robot without edges misses none.
    may_be_silent = arguments.format != "text" or not plan.edges
    begun = time.monotonic()
    observers = observe_topics(
        "tfcompose_verify",
        parts_of(plan),
        bag=arguments.bag,
        ros=plan.ros,
        duration_s=arguments.duration,
        may_be_silent=may_be_silent,
        joint_topics=joint_states_topics(plan),
    )
    seconds = time.monotonic() - begun
    verdicts = verify(plan, observers, arguments.tolerance, places)
    if running:
        verdicts = [of_other_plan(verdict, running) for verdict in verdicts]
    return _report(arguments, plan, verdicts, seconds)


def _running_plan(arguments: Namespace) -> tuple[Plan, dict[str, Span]] | None:
    """Return the plan of the robot that runs in this ROS domain, with an empty map of places.

    Return None if the command line names a file, a bag or options that change the robot file.
    """
    from tfcompose.cli.runs import plan_of_domain

    changed = changes_robot(arguments)
    if arguments.running and (arguments.file or arguments.bag or changed):
        fail("--running takes the plan of the robot that runs: no FILE, --bag or --profile")
    if arguments.file or arguments.bag or changed:
        return None
    plan = plan_of_domain()
    if plan is None and arguments.running:
        fail("not exactly one robot runs in this ROS domain; tfcompose ps lists the robots")
    return (plan, {}) if plan else None


def _warn_of_adjustments(arguments: Namespace, plan: Plan) -> None:
    """Print the edges whose poses nudge changed on the running robot."""
    from tfcompose.cli.runs import adjusted_edges

    for edge in () if arguments.bag else adjusted_edges(plan.robot):
        if edge.adjustment:
            warn(
                f"{edge.name} is adjusted by {edge.adjustment.text} on the running robot;"
                f" tfcompose nudge {edge.mounts or edge.child} --reset restores the built pose"
            )


def other_plan(arguments: Namespace, plan: Plan) -> Plan | None:
    """Return the plan of the robot that runs here if it is a variant of ``plan``.

    A variant has other overlays, processes or owners, for example from another profile. The
    function prints a note about the variant. Other poses do not make a variant, because verify
    must find them.
    """
    from tfcompose.cli.runs import run_of_domain

    running = None if arguments.bag else run_of_domain()
    if running is None or running[1].robot != plan.robot:
        return None
    if running[1].overlays != plan.overlays:
        overlays, of_plan = (
            ", ".join(each.overlays) or "no overlay" for each in (running[1], plan)
        )
        difference = f"{overlays}, and this plan has {of_plan}"
    elif _shape(running[1]) != _shape(plan):
        difference = "other processes or owners than this plan has, as by another --profile"
    else:
        return None
    warn(
        f"{running[0].name} runs with {difference};"
        " tfcompose verify --running compares with the plan that runs"
    )
    return running[1]


def _shape(plan: Plan) -> tuple[Mapping[str, str], Mapping[str, str]]:
    """Return the kind of each process of the plan, and the owner of each edge."""
    kinds = {process.name: process.kind for process in plan.processes}
    return kinds, {edge.child: edge.owner for edge in plan.edges}


def of_other_plan(verdict: Verdict, running: Plan) -> Verdict:
    """Return the verdict without advice about processes of the running plan."""
    from dataclasses import replace

    advice = "tfcompose verify --running compares with the plan that runs"
    nodes = [node for process in running.processes for node in process.nodes]
    findings = list(verdict.findings)
    for index, finding in enumerate(findings):
        if any(node in finding.message for node in nodes):
            findings[index] = replace(finding, help=advice)
    return replace(verdict, findings=tuple(findings))


def _report(arguments: Namespace, plan: Plan, verdicts: list[Verdict], seconds: float) -> int:
    """Print the verdicts and return the exit code."""
    failing = frozenset({"error"} if arguments.fail_on == "error" else {"error", "warning"})
    findings = [finding for verdict in verdicts for finding in verdict.findings]
    if arguments.format == "junit":
        from tfcompose.compiler.render.formats import render_junit

        holders = {None: "undeclared", "": "tree"}
        cases = [
            (holders.get(verdict.owner) or str(verdict.owner), verdict.edge, verdict.findings)
            for verdict in verdicts
        ]
        sys.stdout.write(render_junit(plan.robot, cases, failing=failing, seconds=seconds))
    elif arguments.format == "json":
        from tfcompose.compiler.render.formats import render_json

        sys.stdout.write(render_json(findings))
    else:
        from tfcompose.guard.verdict.verify import summary

        print_findings(findings, sys.stdout)
        print(f"{plan.robot}: {summary(verdicts)}, in {arguments.bag or 'the running tree'}")
    return int(any(finding.severity in failing for finding in findings))
