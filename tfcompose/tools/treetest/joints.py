"""Expectations of a joint: its declaration in the robot file, and the motion of its edge."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from tfcompose.foundation.findings import Note, finding
from tfcompose.foundation.geometry import Offset, Pose, norm, offset_of
from tfcompose.foundation.numbers import numbers
from tfcompose.tools.treetest.replay import accepted_pose, names_of

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.foundation.findings import Finding
    from tfcompose.foundation.geometry import Vector
    from tfcompose.model.plan import PlanEdge, PlanJoint
    from tfcompose.tools.treetest.case import Case
    from tfcompose.tools.treetest.replay import Arrival
    from tfcompose.tools.treetest.spec import JointExpectation


@dataclass(slots=True)
class JointProbe:
    """Finds the first pose of an edge that its joint cannot reach at any position."""

    parent: str
    child: str
    joint: PlanJoint
    #: The pose of the child at joint position 0.
    origin: Pose
    within: Offset
    #: The first pose off the joint's motion; None: every pose is on it.
    pose: Pose | None = None
    offset: Offset = field(default_factory=lambda: Offset(0.0, 0.0))
    elapsed_s: float = 0.0

    def take(self, arrival: Arrival) -> None:
        """Compare the edge's transforms in a message with the joint's motion."""
        for row in arrival.rows:
            if self.pose is not None or names_of(row) != (self.parent, self.child):
                continue
            pose = accepted_pose(row)
            if pose is None:
                continue
            motion = self.origin.inverse() @ pose
            offset = offset_of(self.joint.nearest(motion), motion)
            if offset.beyond(self.within):
                self.pose, self.offset, self.elapsed_s = pose, offset, arrival.elapsed_s


def expected_motion(expected: JointExpectation, planned: PlanEdge) -> JointProbe | None:
    """Return the probe for a joint's motion; what is not expected is as the robot file says.

    None if the edge has no joint.
    """
    if planned.joint is None:
        return None
    joint = replace(
        planned.joint,
        type=expected.type or planned.joint.type,
        axis=_unit(expected.axis or planned.joint.axis),
    )
    origin = Pose(expected.xyz or planned.pose.xyz, expected.rotation or planned.pose.quat_xyzw)
    return JointProbe(planned.parent, planned.child, joint, origin, Offset(*expected.within))


def judge_declared_joint(
    case: Case, pair: str, expected: JointExpectation, planned: PlanEdge
) -> Iterator[Finding]:
    """Yield a finding for each property that the robot file declares otherwise."""
    joint, at = planned.joint, ("expect", "edges", pair, "joint")
    if joint is None:
        message = f"{pair}: expected a joint; the robot file has none there"
        yield finding("TF931", message, case.span(*at))
        return
    for name, value, declared in (
        ("name", expected.name, joint.name),
        ("type", expected.type, joint.type),
    ):
        if value not in {None, declared}:
            message = f"{pair}: expected the joint's {name} {value}; the robot file has {declared}"
            yield finding("TF931", message, case.value_span(*at, name))
    within = Offset(*expected.within)
    if expected.axis is not None:
        axes = _unit(expected.axis), _unit(joint.axis)
        tilt = norm(tuple(a - b for a, b in zip(*axes, strict=True)))
        if Offset(0.0, tilt).beyond(within):
            message = (
                f"{pair}: expected the axis {numbers(expected.axis)}; the robot file declares"
                f" {numbers(joint.axis)}"
            )
            yield finding("TF931", message, case.value_span(*at, "axis"))
    origin = Pose(expected.xyz or planned.pose.xyz, expected.rotation or planned.pose.quat_xyzw)
    offset = offset_of(origin, planned.pose)
    if offset.beyond(within):
        message = (
            f"{pair}: expected the joint's origin within {within.text}; the robot file places it"
            f" {offset.text} away"
        )
        yield finding("TF931", message, case.span(*at))


def judge_motion(case: Case, pair: str, probe: JointProbe) -> Iterator[Finding]:
    """Yield a finding if the edge left the motion of its joint."""
    if probe.pose is None:
        return
    xyz, quat = numbers(probe.pose.xyz), numbers(probe.pose.quat_xyzw)
    message = (
        f"{pair}: expected the motion of a {probe.joint.type} joint about"
        f" {numbers(probe.joint.axis)} within {probe.within.text};"
        f" off by {probe.offset.text} at {probe.elapsed_s:.3f} s"
    )
    span = case.span("expect", "edges", pair, "joint")
    yield finding("TF931", message, span, notes=[Note(f"it was xyz {xyz}, quat_xyzw {quat}")])


def _unit(axis: Vector) -> Vector:
    length = norm(axis)
    x, y, z = axis
    return (x / length, y / length, z / length)
