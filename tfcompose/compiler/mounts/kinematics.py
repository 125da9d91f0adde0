"""Poses of a robot's frames at given joint positions."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.foundation.geometry import Pose

if TYPE_CHECKING:
    from collections.abc import Mapping

    from tfcompose.model.robot import Robot


def joint_positions(robot: Robot, positions: Mapping[str, float]) -> dict[str, float]:
    """Return the position of each joint, in rad or m, from the given ``positions``.

    A joint that mimics another joint follows it. Any other joint without a position is at 0.
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
    """Return the pose of each frame in the root frame of its tree.

    ``positions`` maps joints to positions in rad or m, as in ``joint_positions``.
    """
    above = {edge.child: edge for edge in reversed(robot.edges)}  # the first parent wins
    joints = joint_positions(robot, positions)
    poses: dict[str, Pose] = {}
    for frame in robot.frames:
        chain: list[str] = []
        ancestor = frame
        while ancestor in above and ancestor not in poses and ancestor not in chain:
            chain.append(ancestor)
            ancestor = above[ancestor].parent
        pose = poses.setdefault(ancestor, Pose())
        for name in reversed(chain):
            edge = above[name]
            motion = Pose()
            if edge.joint is not None:
                motion = edge.joint.motion(joints[edge.joint.name])
            pose = poses[name] = pose @ edge.pose @ motion
    return poses
