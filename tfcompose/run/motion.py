"""How frames move: joints by their positions, and the paths of simulated bodies. Pure functions; metres and radians."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from tfcompose.pose import Pose, quat_from_axis_angle, quat_from_rpy

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from tfcompose.plan import Joint, PlanEdge

TURNING = ("revolute", "continuous")
SLIDING = ("prismatic",)


def joint_motion(joint: Joint, position: float) -> Pose:
    """Return the pose of the child at ``position`` in the child at 0: a turn about the axis or a slide along it.

    ``position`` is in radians, or in metres for a prismatic joint. A joint of any other type does not move (URDF:
    ``fixed``; ``floating`` and ``planar`` have no single position).
    """
    if joint.type in TURNING:
        return Pose(quat_xyzw=quat_from_axis_angle(joint.axis, position))
    if joint.type in SLIDING:
        x, y, z = joint.axis
        return Pose((x * position, y * position, z * position))
    return Pose()


def circle(radius: float, speed: float, time_s: float) -> Pose:
    """Return the pose, in the circle's centre, of a body that drives on it: x = r cos ωt, y = r sin ωt.

    ``speed`` is ω in rad/s, counter-clockwise where positive. The body looks where it goes.
    """
    angle = speed * time_s
    heading = angle + math.copysign(math.pi / 2, speed)
    return Pose((radius * math.cos(angle), radius * math.sin(angle), 0.0), quat_from_rpy(0.0, 0.0, heading))


class Joints:
    """The edges that move by joint positions.

    A joint that mimics another follows it, also through a chain: multiplier · q + offset at each step. As in
    robot_state_publisher, a position that was sent for the mimic itself wins over the one it would follow. Only what
    a message says is published: a joint that it says nothing about was measured at another time, and that message's
    stamp would be false for it.
    """

    def __init__(self, edges: Sequence[PlanEdge]) -> None:
        self._edges = [(edge.pose, edge.joint) for edge in edges if edge.joint]
        self._mimics = {joint.name: joint for _, joint in self._edges if joint.mimic is not None}
        names = {joint.name for _, joint in self._edges}
        #: The names that a message can say something with.
        self.names = frozenset(names | {joint.mimic for joint in self._mimics.values() if joint.mimic is not None})

    def poses(self, sent: Mapping[str, float]) -> dict[int, Pose]:
        """Return the poses, by the edge's index, of all edges that these positions determine."""
        found = {}
        for index, (pose, joint) in enumerate(self._edges):
            position = self._position(joint, sent)
            if position is not None:
                found[index] = pose @ joint_motion(joint, position)
        return found

    def _position(self, joint: Joint, sent: Mapping[str, float]) -> float | None:
        """Return the joint's position, or None where nothing was sent that it follows from; a loop determines none."""
        multiplier, offset = 1.0, 0.0
        name, mimic = joint.name, self._mimics.get(joint.name)
        for _ in range(len(self._mimics) + 1):
            if name in sent:
                return multiplier * sent[name] + offset
            if mimic is None or mimic.mimic is None:
                return None
            offset += multiplier * mimic.offset
            multiplier *= mimic.multiplier
            name, mimic = mimic.mimic, self._mimics.get(mimic.mimic)
        return None


def read_positions(names: Sequence[str], positions: Sequence[float], wanted: frozenset[str]) -> dict[str, float]:
    """Return the positions of the wanted joints in a JointState; of a name that comes twice the first counts.

    Raises:
        ValueError: with a sentence that is the same for the same fault, if the message cannot be believed.
    """
    if len(names) > 0 and len(positions) == 0:
        raise ValueError("it has names and no positions")
    if len(names) != len(positions):
        raise ValueError("it has another number of positions than of names")
    found: dict[str, float] = {}
    for name, position in zip(names, positions, strict=True):
        if name not in wanted:
            continue
        if not math.isfinite(position):
            raise ValueError(f"the position of {name} is not finite")
        found.setdefault(name, position)
    return found
