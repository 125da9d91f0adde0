"""TF709: inertia missing."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.findings import Finding, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Robot


def inertia_missing(robot: Robot) -> Iterator[Finding]:
    """A part that moves has no mass, though others have.

    Simulators drop a link without inertia, with everything on it, or refuse the robot; dynamics treat it as nothing.
    Give the link ``inertial: {mass: 0.5 kg}``: the tensor is computed from its shape. What is fixed together counts as
    one part, and a robot in which no moving part has a mass, but for that of sensors on it, is a robot for TF only, and
    is left alone.
    """
    fixed: dict[str, list[str]] = {}
    for edge in robot.edges:
        if edge.kind == "static":
            fixed.setdefault(edge.parent, []).append(edge.child)
    moving = [edge for edge in robot.edges if (edge.joint or edge.free) and edge.child in robot.links]
    masses = {name for name, link in robot.links.items() if link.inertial}
    own = masses - {frame for sensor in robot.sensors for frame in (sensor.mount, *sensor.frames)}
    other = next((edge.child for edge in moving if _has_one(own, fixed, edge.child)), None)
    for edge in moving if other else ():
        if not _has_one(masses, fixed, edge.child):
            message = f"{edge.child} moves by {edge.joint_name} and has no mass, while {other} has"
            link = robot.links[edge.child]
            yield finding("TF709", message, link.at, help="inertial: {mass: 0.5 kg}")


def _has_one(names: set[str], fixed: dict[str, list[str]], link: str) -> bool:
    """Whether the link, or anything that is fixed to it, is one of these."""
    waiting, seen = [link], set[str]()
    while waiting:
        name = waiting.pop()
        if name in names:
            return True
        if name not in seen:
            seen.add(name)
            waiting += fixed.get(name, ())
    return False
