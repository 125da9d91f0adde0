"""TF709: inertia missing."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.diagnostic import Diagnostic, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Robot


def inertia_missing(robot: Robot) -> Iterator[Diagnostic]:
    """A part that moves has no mass, though others have.

    Simulators drop a link without inertia, with everything on it, or refuse the robot; dynamics treat it as nothing.
    Give the link ``inertial: {mass: 0.5 kg}``: the tensor is computed from its shape. What is fixed together counts as
    one part, and a robot in which no moving part has a mass is a robot for TF only, and is left alone.
    """
    fixed: dict[str, list[str]] = {}
    for edge in robot.edges:
        if edge.kind == "static":
            fixed.setdefault(edge.parent, []).append(edge.child)
    moving = [edge for edge in robot.edges if (edge.joint or edge.free) and edge.child in robot.links]
    weighed = {edge.child: _weighs(robot, fixed, edge.child) for edge in moving}
    if not any(weighed.values()):
        return
    other = next(child for child, has in weighed.items() if has)
    for edge in moving:
        if not weighed[edge.child]:
            message = f"{edge.child} moves by {edge.joint_name} and has no mass, while {other} has"
            link = robot.links[edge.child]
            yield finding("TF709", message, link.at, help="inertial: {mass: 0.5 kg}")


def _weighs(robot: Robot, fixed: dict[str, list[str]], link: str) -> bool:
    """Whether the link, or anything that is fixed to it, has a mass."""
    waiting, seen = [link], set[str]()
    while waiting:
        name = waiting.pop()
        if name in seen:
            continue
        seen.add(name)
        body = robot.links.get(name)
        if body and body.inertial:
            return True
        waiting += fixed.get(name, ())
    return False
