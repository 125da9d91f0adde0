"""How much room the robot's bodies take."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from tfcompose.geometry import Pose

if TYPE_CHECKING:
    from tfcompose.geometry import Vector
    from tfcompose.model import Robot, Shape

Box = tuple[list[float], list[float]]

#: How far from the bodies something still counts as on the robot, in metres: the arm of a mount.
REACH = 0.2


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
    beside: dict[str, list[tuple[str, Pose]]] = {}
    for edge in fixed:
        beside.setdefault(edge.parent, []).append((edge.child, edge.pose))
        beside.setdefault(edge.child, []).append((edge.parent, edge.pose.inverse()))
    poses, waiting = {frame: Pose()}, [frame]
    while waiting:
        here = waiting.pop()
        for there, pose in beside.get(here, ()):
            if there not in poses:
                poses[there] = poses[here] @ pose
                waiting.append(there)
    return poses


def is_near(box: Box, xyz: Vector) -> bool:
    """Return whether the point is in the box, or within reach of it."""
    return all(low - REACH <= value <= high + REACH for low, value, high in zip(box[0], xyz, box[1], strict=True))


def _radius(shape: Shape) -> float:
    if shape.kind == "sphere":
        return shape.size[0]
    if shape.kind == "cylinder":
        return math.hypot(shape.size[0], shape.size[1] / 2)
    return math.hypot(*shape.size) / 2
