"""TF615: calibration probably inverse."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from tfcompose.check.envelope import envelope, is_near
from tfcompose.findings import Finding, Note, finding
from tfcompose.geometry import Pose, norm

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Calibration, Edge, Robot

#: How much nearer to the nominal pose the inverse must be.
NEARER = 0.9


def calibration_probably_inverse(robot: Robot) -> Iterator[Finding]:
    """A calibration is probably the wrong way round.

    Turned round it is near the pose written beside it; or, where none is, it puts the sensor outside the robot's bodies
    and turned round it would not. Calibration tools differ in whether they write the pose of the camera in the base or
    of the base in the camera. Turn the values round, or name the entry's frames the other way: parent: and child:.
    """
    for edge in robot.edges:
        made, why = edge.calibration, why_inverse(robot, edge)
        if made and why:
            message = f"{made.name} is probably that of {made.parent} in {made.child}: {why}"
            advice = f"turn the values round, or take it as the pose of {made.parent}: swap parent and child"
            note = Note("the values stand here", made.at)
            found = finding("TF615", message, made.named_at, help=advice, notes=[note], severity="warning")
            yield replace(found, severity="error") if made.nominal else found


def why_inverse(robot: Robot, edge: Edge) -> str:
    """Return what shows that the edge's calibration is inverse, or an empty text."""
    made = edge.calibration
    if made is None or made.entry == Pose():
        return ""
    back = made.pose.inverse()
    return _nearer(made, back) if made.nominal else _outside(robot, made, back, edge.sensor)


def _nearer(made: Calibration, back: Pose) -> str:
    far, turned = made.off(back)
    if _size(made, made.pose) > 1 and _size(made, back) < NEARER * _size(made, made.pose):
        mm, deg = round(far * 1000, 3), round(math.degrees(turned), 3)
        return f"turned round it is {mm:.3g} mm and {deg:.2g} deg from nominal"
    return ""


def _size(made: Calibration, pose: Pose) -> float:
    """Return how far the pose is from nominal, as a multiple of the limit."""
    far, turned = made.off(pose)
    return max(far / (made.limit_m or 1e-9), turned / (made.limit_rad or 1e-9))


def _outside(robot: Robot, made: Calibration, back: Pose, sensor: str | None) -> str:
    box = envelope(robot, made.parent, sensor)
    if box and not is_near(box, made.pose.xyz) and is_near(box, back.xyz):
        return f"it is {norm(made.pose.xyz):.3g} m away and outside the robot, turned round it is not"
    return ""
