"""Stand-ins for joint states: where each joint is, and how it moves."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from tfcompose.findings import Finding, did_you_mean, finding
from tfcompose.language.process import SWEEP
from tfcompose.plan import Sweep

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.language.robot import RobotSpec
    from tfcompose.load import Source
    from tfcompose.model import Edge, Joint, Process

#: The time of one sweep, in seconds; longer where a joint may not move that fast.
PERIOD_S = 6.0


def with_positions(
    process: Process, spec: RobotSpec, edges: tuple[Edge, ...], source: Source, found: list[Finding]
) -> Process:
    """Give a stand-in for joint states what it says of every joint that has a position of its own.

    A joint that mimics another is left out: it follows, and the process computes it. Where nothing is said a joint is
    at 0, or in the middle between its limits if 0 is not between them, as joint_state_publisher has it.
    """
    said = spec.processes.get(process.name)
    wanted = said.simulate.joints if said and said.simulate else None
    if process.simulate is None or process.simulate.kind != "joints" or wanted is None:
        return process
    all_joints = {edge.joint.name: edge.joint for edge in edges if edge.joint}
    joints = {name: joint for name, joint in all_joints.items() if _has_position(joint)}
    if isinstance(wanted, dict):
        found += _findings(wanted, all_joints, process, source)
    each = {name: wanted.get(name, None) if isinstance(wanted, dict) else wanted for name in joints}
    positions = {
        name: _rest(joints[name]) if what is None or isinstance(what, str) else what for name, what in each.items()
    }
    sweeps = {name: _sweep(joints[name]) for name, what in each.items() if what == SWEEP}
    moving = {name: sweep for name, sweep in sweeps.items() if sweep}
    return replace(process, simulate=replace(process.simulate, joints=positions, sweep=moving))


def _findings(wanted: dict[str, Any], joints: dict[str, Joint], process: Process, source: Source) -> Iterator[Finding]:
    """Give a finding for each joint that is not there, or cannot move as it should."""
    movable = [name for name, joint in joints.items() if _has_position(joint)]
    for name, what in wanted.items():
        place = source.at_key(("processes", process.name, "simulate", "joints", name))
        joint = joints.get(name)
        if joint and joint.mimic:
            advice = f"say the position of {joint.mimic}"
            yield finding("TF703", f"{name} has no position of its own: it mimics {joint.mimic}", place, help=advice)
        elif name not in movable:
            advice = did_you_mean(name, movable, f"there is {', '.join(movable)}" if movable else "no joint moves")
            yield finding("TF703", f"no moving joint {name}", place, help=advice)
        elif joint and what == SWEEP and _sweep(joint) is None:
            advice = f"give {name} a limit: {{lower, upper}}, or say a position here"
            yield finding("TF106", f"{name} slides and has no limits to sweep between", place, help=advice)


def _has_position(joint: Joint) -> bool:
    """Whether the joint has a single position, and one of its own."""
    return joint.mimic is None and joint.type in {"revolute", "continuous", "prismatic"}


def _rest(joint: Joint) -> float:
    limit = joint.limit
    if joint.type == "continuous" or limit is None or limit.lower is None or limit.upper is None:
        return 0.0
    return 0.0 if limit.lower <= 0 <= limit.upper else (limit.lower + limit.upper) / 2


def _sweep(joint: Joint) -> Sweep | None:
    """Return the sweep between the joint's limits, no faster than it may move; None for a slide without limits.

    Of two limits a missing one is 0, as URDF's readers have it.
    """
    limit = joint.limit
    fastest = limit.velocity if limit and limit.velocity else math.inf
    if joint.type == "continuous":
        return Sweep(max(PERIOD_S, math.tau / fastest))
    if limit is not None and (limit.lower is not None or limit.upper is not None):
        lower, upper = limit.lower or 0.0, limit.upper or 0.0
    elif joint.type == "revolute":
        lower, upper = -math.pi, math.pi
    else:
        return None
    return Sweep(max(PERIOD_S, math.pi * (upper - lower) / fastest), lower, upper)
