"""TF730: body in no URDF."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.findings import Finding, Note, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Robot

SHOWN = 5


def body_in_no_urdf(robot: Robot) -> Iterator[Finding]:
    """A link has a body, and is not below the base.

    The URDF holds what hangs below ``base``, so nobody draws this body or collides with it; the frame is published all
    the same. Name a base above it, ``base: map``, or make what stands beside the robot a robot of its own: a part with
    a ``namespace`` has its own description. All such links are one finding.
    """
    if robot.base is None:
        return
    drawn = robot.below(robot.base) | {frame for sensor in robot.sensors for frame in sensor.frames}
    drawn |= {f"{part.prefix}{name}" for part in robot.parts for name in part.robot.links}
    bodies = (link for link in robot.links.values() if link.visuals or link.collisions or link.inertial)
    outside = {link.name: link.at for link in bodies if link.name not in drawn}
    tree = next((robot.below(root) for root in robot.roots() if robot.base in robot.below(root)), set[str]())
    first, *others = [name for name in outside if name in tree] or [""]  # other trees are another rule's
    if first:
        more = f", and so {'are' if others[1:] else 'is'} {len(others)} more" if others else ""
        notes = [Note(f"{name} is another", outside[name]) for name in others[:SHOWN]]
        message = f"the body of {first} is in no URDF: it is not below the base {robot.base}{more}"
        advice = f"base: a frame above {first} and {robot.base}; or a part with a namespace"
        yield finding("TF730", message, outside[first], help=advice, notes=notes)
