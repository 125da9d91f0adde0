"""Where frames are in the robot's base, and how much room its bodies take."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from tfcompose.geometry import Pose

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.geometry import Vector
    from tfcompose.model import Edge, Robot, Shape

#: The least and the greatest x, y, z.
Box = tuple[list[float], list[float]]

#: Kinds of sensors that take images.
CAMERAS = frozenset({"camera", "mono", "stereo", "rgbd", "tof"})

#: How far from the bodies something still counts as on the robot, in metres: the arm of a mount.
_REACH_M = 0.2

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


def envelope(robot: Robot, frame: str, without: str | None = None) -> Box | None:
    """Return the least and greatest x, y, z in ``frame`` of the bodies that are fixed to it, or None without any.

    Each shape counts with the sphere around it. ``without`` names a sensor whose bodies do not count.
    """
    inside = {edge.child for edge in robot.edges if edge.sensor == without} if without else set()
    spheres = [
        (pose @ shape.pose, _radius(shape))
        for name, pose in _fixed_to(robot, frame).items()
        if name in robot.links and name not in inside
        for shape in (*robot.links[name].visuals, *robot.links[name].collisions)
    ]
    if not spheres:
        return None
    least = [min(pose.xyz[axis] - radius for pose, radius in spheres) for axis in range(3)]
    most = [max(pose.xyz[axis] + radius for pose, radius in spheres) for axis in range(3)]
    return least, most


def _fixed_to(robot: Robot, frame: str) -> dict[str, Pose]:
    """Return the pose in ``frame`` of each frame that is fixed to it, up and down the tree."""
    fixed = [edge for edge in robot.edges if edge.kind == "static"]
    neighbours: dict[str, list[tuple[str, Pose]]] = {}
    for edge in fixed:
        neighbours.setdefault(edge.parent, []).append((edge.child, edge.pose))
        neighbours.setdefault(edge.child, []).append((edge.parent, edge.pose.inverse()))
    poses, waiting = {frame: Pose()}, [frame]
    while waiting:
        here = waiting.pop()
        for there, pose in neighbours.get(here, ()):
            if there not in poses:
                poses[there] = poses[here] @ pose
                waiting.append(there)
    return poses


def is_near(box: Box, xyz: Vector) -> bool:
    """Return whether the point is in the box, or within reach of it."""
    return all(low - _REACH_M <= value <= high + _REACH_M for low, value, high in zip(box[0], xyz, box[1], strict=True))


def _radius(shape: Shape) -> float:
    if shape.kind == "sphere":
        return shape.size[0]
    if shape.kind == "cylinder":
        return math.hypot(shape.size[0], shape.size[1] / 2)
    return math.hypot(*shape.size) / 2
