"""Poses of a robot's frames at given joint positions."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.foundation.geometry import Pose, quat_from_axis_angle

if TYPE_CHECKING:
    from collections.abc import Mapping

    from tfcompose.model.robot import Robot


def joint_positions(robot: Robot, positions: Mapping[str, float]) -> dict[str, float]:
    """Return the position of each joint, in rad or m, from the ``positions`` of some.

    A joint that mimics another follows it; one without a position is at 0.
    """
    joints = {edge.joint.name: edge.joint for edge in robot.edges if edge.joint}

    def position(name: str, passed: frozenset[str] = frozenset()) -> float:
        joint = joints.get(name)
        if joint is None or name in passed:
            return 0.0
        if joint.mimic is None:
            return positions.get(name, 0.0)
        return joint.offset + joint.multiplier * position(joint.mimic, passed | {name})

    return {name: position(name) for name in joints}


def poses_in_roots(robot: Robot, positions: Mapping[str, float]) -> dict[str, Pose]:
    """Return the pose of each frame in the root of its tree.

    ``positions`` are as for ``joint_positions``.
    """
    above = {edge.child: edge for edge in reversed(robot.edges)}  # of several parents the first
    joints = joint_positions(robot, positions)
    poses: dict[str, Pose] = {}
    for frame in robot.frames:
        chain: list[str] = []
        at = frame
        while at in above and at not in poses and at not in chain:
            chain.append(at)
            at = above[at].parent
        pose = poses.setdefault(at, Pose())
        for name in reversed(chain):
            edge = above[name]
            motion = Pose()
            if edge.joint is not None:
                value = joints[edge.joint.name]
                x, y, z = edge.joint.axis
                slides = edge.joint.type == "prismatic"
                motion = (
                    Pose((x * value, y * value, z * value))
                    if slides
                    else Pose(quat_xyzw=quat_from_axis_angle((x, y, z), value))
                )
            pose = poses[name] = pose @ edge.pose @ motion
    return poses
