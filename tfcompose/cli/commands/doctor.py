"""Diagnose the running tree.

Listen to the running system for a few seconds and report problems: disconnected trees, loops, two
publishers of one edge, stamps that no lookup can match, low rates, frames that no listener
receives, a silent /clock, missing joint states, settings that prevent discovery. Each finding
names the node and the numbers. With a robot file, a built plan, or a robot of tfcompose in this
ROS domain, also check for the expected edges. Ctrl-C ends it early and prints the findings so
far.
"""

from __future__ import annotations

import os
import sys
from typing import TYPE_CHECKING

from tfcompose.cli.options import add_for, add_format, add_variant, changes_robot, namespace
from tfcompose.cli.terminal import UNREADABLE, exit_code_of, fail, print_findings, printable
from tfcompose.foundation.text import plural

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace

    from tfcompose.foundation.findings import Finding
    from tfcompose.model.plan import Plan

#: Maximum number of trees whose roots a finding names.
MOST_ROOTS = 6


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument(
        "file",
        nargs="?",
        metavar="FILE|PLAN",
        help="the expected tree; default: the robot that runs in this ROS domain",
    )
    add_variant(parser)
    add_for(parser, "listen for S seconds; default: 5", 5.0)
    parser.add_argument(
        "--namespace", type=namespace, metavar="NS", help="use /NS/tf and /NS/tf_static"
    )
    add_format(parser)


def run(arguments: Namespace) -> int:
    """Observe and print the findings.

    Return 0 without findings, 1 with findings, 2 for wrong use.
    """
    from tfcompose.foundation.findings import finding
    from tfcompose.foundation.signals import Stop
    from tfcompose.model.plan import RosSettings
    from tfcompose.tf.ros.environment import (
        RosError,
        child_environment,
        no_ros,
        other_distro,
        other_middleware,
        ros_trouble,
    )

    missing = no_ros()
    if missing:
        return _print([missing], arguments.format)
    plan = _plan(arguments)
    ros = plan.ros if plan else RosSettings()
    odd = (other_middleware(os.environ, ros), other_distro(os.environ, ros))
    os.environ.update(child_environment(os.environ, ros, is_built_in=True))
    trouble = ros_trouble(os.environ, ros)
    if trouble:
        return _print([trouble], arguments.format)
    from tfcompose.cli.live import check_early_end
    from tfcompose.guard.verdict.doctor import examine
    from tfcompose.model.plan.topics import namespace_options
    from tfcompose.tf.live.snapshot import observe

    with Stop() as stop:
        try:
            examined = examine(
                observe(_expected_topics(plan, arguments.namespace), arguments.duration, stop)
            )
        except RosError as error:
            return _print([finding("TF901", str(error), None)], arguments.format)
        if stop.requested:
            check_early_end(examined.seconds, arguments.duration, heard=bool(examined.edges))
    findings = [*(finding for finding in odd if finding), *examined.findings]
    code = _print(findings, arguments.format)
    if arguments.format == "text":
        observed = f"{plural(examined.edges, 'edge')} from {plural(examined.nodes, 'node')}"
        observed += (
            f" below {printable(', '.join(examined.roots[:MOST_ROOTS]))}" if examined.roots else ""
        )
        print(f"observed {observed} for {examined.seconds:.1f} s: {_summary(findings)}")
        for cost in examined.costs:
            print(printable(cost))
        if examined.edges and examined.elsewhere:
            options = namespace_options(examined.elsewhere)
            print(f"TF is also on {', '.join(examined.elsewhere[:MOST_ROOTS])}: {options}")
    return code


def _print(findings: list[Finding], form: str) -> int:
    """Print the findings and return the exit code."""
    if form == "json":
        from tfcompose.compiler.render.formats import render_json

        sys.stdout.write(render_json(findings))
    else:
        print_findings(findings, sys.stdout)
    return exit_code_of(findings) if findings else 0


def _summary(findings: list[Finding]) -> str:
    errors = sum(finding.severity == "error" for finding in findings)
    counts = ((errors, "error"), (len(findings) - errors, "warning"))
    return " and ".join(plural(n, noun) for n, noun in counts if n) or "nothing is wrong"


def _plan(arguments: Namespace) -> Plan | None:
    """Return the plan of the robot on the command line, or of the robot that runs here.

    Return None if neither exists.

    Raises:
        SystemExit: after the errors of the robot are printed.
    """
    from tfcompose.cli.plans import expected_plan
    from tfcompose.cli.runs import plan_of_domain

    if arguments.file is not None:
        return expected_plan(arguments.file, arguments)[0]
    if changes_robot(arguments):
        fail("--profile, --robot, --overlay, --set and NAME:=VALUE need a robot file", UNREADABLE)
    return plan_of_domain()


def _expected_topics(plan: Plan | None, below: str | None) -> dict[tuple[str, str], Plan | None]:
    """Return the pairs of topics to observe, each with its part of the plan."""
    from tfcompose.model.plan.topics import parts_of, topics_below

    topics = topics_below(below or "")
    if plan is None:
        return {topics: None}
    parts = parts_of(plan)
    return (
        {topics: parts.get(topics, plan)} if below is not None else dict(parts) or {topics: plan}
    )
