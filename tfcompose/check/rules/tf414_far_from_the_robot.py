"""TF414: far from the robot."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.check.geometry import placed
from tfcompose.findings import Finding, finding
from tfcompose.geometry import norm

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Robot


#: No part of a usual robot is farther from what it is mounted on; larger ones are known by their bodies and mounts.
USUAL_M = 5.0
#: No robot is larger, unless a body says so.
LARGEST_M = 100.0
TIMES = 3


def far_from_the_robot(robot: Robot) -> Iterator[Finding]:
    """A mount or a body is far larger than the robot; it is probably written in millimetres.

    A bare number is in metres. Drawings are in millimetres, and 250 becomes a sensor that floats a quarter of a
    kilometre away. Write the unit: ``250 mm``. The limit is three times the robot's bodies or usual mounts, and at
    least 5 m. A value with a unit is believed.
    """
    sizes = [max(shape.size) for link in robot.links.values() for shape in (*link.visuals, *link.collisions)]
    for link in robot.links.values():
        largest = max((max(shape.size) for shape in (*link.visuals, *link.collisions)), default=0.0)
        if largest > LARGEST_M:
            message = f"the body of {link.name} is {largest:g} m long"
            yield finding("TF414", message, link.at, help=f"in millimetres: {largest:g} mm")
    body = max((size for size in sizes if size <= LARGEST_M), default=0.0)
    below = placed(robot, moving=True)
    mounts = [norm(edge.pose.xyz) for edge in robot.edges if edge.given and edge.child in below and any(edge.pose.xyz)]
    limit = min(
        max(USUAL_M, TIMES * body, TIMES * sorted(mounts)[len(mounts) // 2] if mounts else 0.0),
        max(LARGEST_M, TIMES * body),
    )
    moved = {edge.joint_name: edge.child for edge in robot.edges if edge.joint_name}
    mounted = {sensor.name: sensor.mount for sensor in robot.sensors}
    named: dict[str | int, dict[str, str]] = {"joints": moved, "sensors": mounted, "parts": robot.mounted}
    for value in robot.as_written:
        if value.path[2:] != ("xyz",) or norm(value.numbers) <= limit or value.path[0] == "processes":
            continue
        child = named.get(value.path[0], {}).get(value.entry, value.entry)
        distance = norm(tuple(n for n, unit in zip(value.numbers, value.with_unit, strict=True) if not unit))
        if child in below and distance > limit:
            message = f"{value.entry} is {distance:g} m away; the rest of the robot is within {limit:.3g} m"
            farthest = max(range(len(value.numbers)), key=lambda index: abs(value.numbers[index]))
            advice = f"a bare number is in metres; in millimetres: {value.numbers[farthest]:g} mm"
            yield finding("TF414", message, value.place(farthest), help=advice)
