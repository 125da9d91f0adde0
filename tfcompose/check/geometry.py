"""What several rules ask about where things are."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from tfcompose.geometry import Pose

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Edge, Robot

#: Kinds of sensors that take images.
CAMERAS = frozenset({"camera", "mono", "stereo", "rgbd", "tof"})

#: Words in names, the word of the other side, and the axis (0: x, 1: y) on which the two sides differ (REP-103).
_SIDES = {"left": ("right", 1), "right": ("left", 1), "front": ("rear", 0), "rear": ("front", 0), "back": ("front", 0)}
_NEAR_M = 1e-6
#: Nearer to the middle than this, left and right may well be at one place.
_MIDDLE_M = 0.01


def placed(robot: Robot, *, moving: bool = False) -> dict[str, Pose]:
    """Return the pose in the robot's base of each frame fixed to it; ``moving``: also through joints, at zero."""
    poses = {robot.base: Pose()} if robot.base else {}
    children = robot.children() if poses else {}
    waiting = list(poses)
    while waiting:
        parent = waiting.pop()
        for edge in children.get(parent, ()):
            if edge.child not in poses and (edge.kind == "static" or (moving and edge.joint)):
                poses[edge.child] = poses[parent] @ edge.pose
                waiting.append(edge.child)
    return poses


def twins(frame: str) -> Iterator[str]:
    """Yield the names that the frame has on the other side of the robot: left_wheel_link → right_wheel_link."""
    words = frame.split("_")
    for index, word in enumerate(words):
        if word in _SIDES:
            yield "_".join([*words[:index], _SIDES[word][0], *words[index + 1 :]])
            if word == "front":
                yield "_".join([*words[:index], "back", *words[index + 1 :]])


def are_mirrored(one: Edge, other: Edge) -> bool:
    """Return whether the two are named after two sides of the robot and yet stand on the same one, at one place."""
    if one.parent != other.parent or other.child not in twins(one.child):
        return False
    differs = [a != b for a, b in zip(one.child.split("_"), other.child.split("_"), strict=True)]
    axis = _SIDES[one.child.split("_")[differs.index(True)]][1]
    apart = math.dist(one.pose.xyz, other.pose.xyz)
    return apart < _NEAR_M and abs(one.pose.xyz[axis]) > _MIDDLE_M
