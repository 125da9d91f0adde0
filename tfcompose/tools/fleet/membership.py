"""Robot as a member of a fleet.

This module adds the process ``fleet_share`` to the robot, and checks that the fleet file fits the
robot.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from tfcompose.foundation.findings import Finding, Note, RejectedError, did_you_mean, finding
from tfcompose.foundation.text import list_names
from tfcompose.model.robot import Process
from tfcompose.spec.language.recognition import load_named
from tfcompose.spec.load import find_path
from tfcompose.tools.fleet.check import check_fleet
from tfcompose.tools.fleet.preflight import SHARE_COMMAND
from tfcompose.tools.fleet.spec import FleetSpec, validate_fleet

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.compiler.resolve.tool_sections import ToolSection
    from tfcompose.model.robot import Robot
    from tfcompose.spec.language.robot import RobotSpec
    from tfcompose.spec.load import Source

#: The name of the process that shares a robot's edges with its fleet.
SHARE = "fleet_share"
_NAMED_AT_MOST = 8


def share_process(section: ToolSection) -> Iterator[Process]:
    """Yield the process that shares the robot's edges.

    The process is ready once it has started. If it fails, the robot keeps running, because no
    robot needs the others.
    """
    file = find_path(section.value.file, section.span_of("file"))
    spec = section.spec
    yield Process(
        SHARE,
        "run",
        span=section.key_span(),
        argv=(*SHARE_COMMAND, _name(section), f"${{file:{file}}}", *_below(spec)),
        restart="on-failure",
        required=False,
    )


def _name(section: ToolSection) -> str:
    return str(section.value.robot or section.spec.robot)


def _below(spec: RobotSpec) -> tuple[str, ...]:
    """Return the option for the namespace of the robot's TF topics.

    The TF topics are in the robot's namespace only if they are isolated.
    """
    namespace = spec.ros.namespace.strip("/")
    return (
        ("--namespace", namespace) if spec.ros.isolate in {"topics", "both"} and namespace else ()
    )


def wrong_membership(section: ToolSection, robot: Robot) -> list[Finding]:
    """Return findings about the fleet file.

    The fleet file may be unreadable or wrong, may not contain this robot, or may share edges that
    the robot does not have.
    """
    spec, member = section.spec, section.value
    span = section.span_of("file")
    path = find_path(member.file, span)
    if section.read is None:
        return [finding("TF001", f"{path}: files cannot be read here", span)]
    try:
        fleet_source = load_named(section.read(path), path, FleetSpec)
        fleet = validate_fleet(fleet_source)
        wrong = [
            finding for finding in check_fleet(fleet, fleet_source) if finding.severity == "error"
        ]
    except RejectedError as error:
        wrong = list(error.findings)
    if wrong:
        return [
            replace(finding, notes=(*finding.notes, Note("named here", span))) for finding in wrong
        ]
    name = _name(section)
    if name not in fleet.robots:
        span = section.span_of("robot") if member.robot else spec.span_of(("robot",))
        listed = (
            f"robots: {list_names(list(fleet.robots), _NAMED_AT_MOST)}; fleet: {{file: …, robot:"
            " NAME}"
        )
        advice = did_you_mean(name, fleet.robots, listed)
        return [finding("TF886", f"no robot {name} in {path}", span, help=advice)]
    return _unknown_edges(robot, name, fleet, fleet_source, section)


def _unknown_edges(
    robot: Robot, name: str, fleet: FleetSpec, fleet_source: Source, section: ToolSection
) -> list[Finding]:
    """Return a finding for each edge that the fleet shares and the robot does not have.

    If the robot file has errors in entries or a duplicate key, the robot's edges are not certain,
    and the result is empty.
    """
    if robot.broken or any(finding.code == "TF003" for finding in section.spec.spans.findings):
        return []
    edges = {(robot.final(edge.parent), robot.final(edge.child)) for edge in robot.edges}
    named = [f"{parent} → {child}" for parent, child in edges]
    inside = ("share",) if fleet.robots[name].share is None else ("robots", name, "share")
    findings = []
    for index, shared in enumerate(fleet.edges_of(name)):
        if shared.ends in edges:
            continue
        message = f"{name} shares {' → '.join(shared.ends)} in the fleet, but has no such edge"
        notes = [Note("it is shared here", fleet_source.span_of((*inside, index)))]
        advice = did_you_mean(
            " → ".join(shared.ends), named, "an edge is a parent and its child on the live tree"
        )
        findings.append(
            finding("TF887", message, section.span_of("file"), notes=notes, help=advice)
        )
    return findings
