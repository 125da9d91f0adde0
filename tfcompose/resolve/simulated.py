"""Stand-ins for joint states: where each joint is, and how it moves."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from tfcompose.diagnostic import Diagnostic, did_you_mean, finding
from tfcompose.plan import Sweep
from tfcompose.validate.process import SWEEP

if TYPE_CHECKING:
    from tfcompose.load import Source
    from tfcompose.model import Edge, Joint, Process
    from tfcompose.validate.spec import RobotSpec

#: The time of one sweep, in seconds; longer where a joint may not move that fast.
PERIOD_S = 6.0


def with_positions(
    process: Process, spec: RobotSpec, edges: tuple[Edge, ...], source: Source, found: list[Diagnostic]
) -> Process:
    """Give a stand-in for joint states what it says of every joint that has a position of its own.

    A joint that mimics another is left out: it follows. Where nothing is said a joint is at 0, or in the middle between
    its limits if 0 is not between them, as joint_state_publisher has it.
    """
    said = spec.processes.get(process.name)
    wanted = said.simulate.joints if said and said.simulate else None
    if process.simulate is None or process.simulate.kind != "joints" or wanted is None:
        return process
    joints = {edge.joint.name: edge.joint for edge in edges if edge.joint and _has_position(edge.joint)}
    for name in wanted if isinstance(wanted, dict) else ():
        if name not in joints:
            place = source.at_key(("processes", process.name, "simulate", "joints", name))
            advice = did_you_mean(name, joints, f"there is {', '.join(joints)}" if joints else "no joint moves")
            found.append(finding("TF703", f"no moving joint {name}", place, help=advice))
    each = {name: wanted.get(name, None) if isinstance(wanted, dict) else wanted for name in joints}
    positions = {
        name: _rest(joints[name]) if what is None or isinstance(what, str) else what for name, what in each.items()
    }
    sweeps = {name: _sweep(joints[name]) for name, what in each.items() if what == SWEEP}
    moving = {name: sweep for name, sweep in sweeps.items() if sweep}
    return replace(process, simulate=replace(process.simulate, joints=positions, sweep=moving))


def _has_position(joint: Joint) -> bool:
    """Whether the joint has a single position, and one of its own."""
    return joint.mimic is None and joint.type in {"revolute", "continuous", "prismatic"}


def _rest(joint: Joint) -> float:
    limit = joint.limit
    if joint.type == "continuous" or limit is None or limit.lower is None or limit.upper is None:
        return 0.0
    return 0.0 if limit.lower <= 0 <= limit.upper else (limit.lower + limit.upper) / 2


def _sweep(joint: Joint) -> Sweep | None:
    """Return the sweep between the joint's limits, no faster than it may move; None without limits."""
    limit = joint.limit
    fastest = limit.velocity if limit and limit.velocity else math.inf
    if joint.type == "continuous":
        return Sweep(max(PERIOD_S, math.tau / fastest))
    if limit is None or limit.lower is None or limit.upper is None:
        return None
    return Sweep(max(PERIOD_S, math.pi * (limit.upper - limit.lower) / fastest), limit.lower, limit.upper)
