"""The five ways to write a rotation; each becomes a unit quaternion x y z w of the child in the parent."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from tfcompose.geometry import (
    Matrix,
    Quaternion,
    Vector,
    norm,
    normalised,
    quat_from_axis_angle,
    quat_from_matrix,
    quat_from_rpy,
)
from tfcompose.validate.fields import ANGLE_, AXIS, NUMBER_, NUMBERS
from tfcompose.validate.schema import BROKEN, Model, Problems, Type, key, listing, record, then

if TYPE_CHECKING:
    from tfcompose.load import Path

#: How far a quaternion's or a matrix row's length may be from 1: what four written decimals can do.
UNIT_TOLERANCE = 1e-3

DIRECTIONS: dict[str, Vector] = {
    "forward": (0, 0, 0),
    "backward": (0, 0, math.pi),
    "left": (0, 0, math.pi / 2),
    "right": (0, 0, -math.pi / 2),
    "up": (0, -math.pi / 2, 0),
    "down": (0, math.pi / 2, 0),
}


class Turns(Model):
    """A direction by the angles that lead to it from straight ahead."""

    up: float = key(ANGLE_, None)
    down: float = key(ANGLE_, None)
    left: float = key(ANGLE_, None)
    right: float = key(ANGLE_, None)
    roll: float = key(ANGLE_, 0.0, "about the viewing direction, right-handed")


class AxisAngle(Model):
    """A turn about an axis, right-handed."""

    axis: Vector = key(AXIS)
    angle: float = key(ANGLE_)


def _unit(quat_xyzw: Quaternion, path: Path, problems: Problems) -> Any:
    length = norm(quat_xyzw)
    if abs(length - 1) <= UNIT_TOLERANCE:
        return normalised(quat_xyzw)
    advice = "the order is x, y, z, w"
    if length:
        advice = f"normalised it is [{', '.join(f'{part:.6g}' for part in normalised(quat_xyzw))}]; {advice}"
    return problems.refuse("TF402", path, f"the quaternion has length {length:.6g}, not 1", advice)


def _rotation_matrix(rows: Matrix, path: Path, problems: Problems) -> Any:
    pairs = [(i, j) for i in range(3) for j in range(i + 1)]
    worst = max(abs(sum(a * b for a, b in zip(rows[i], rows[j], strict=True)) - (i == j)) for i, j in pairs)
    if worst > UNIT_TOLERANCE:
        message = f"the matrix is no rotation: its rows are off from orthonormal by {worst:.3g}"
        return problems.refuse("TF403", path, message, "three rows; column i is the child's axis i in the parent")
    (a, b, c), (d, e, f), (g, h, i) = rows
    if a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g) < 0:
        advice = "frames are right-handed; one axis is flipped"
        return problems.refuse("TF403", path, "the matrix mirrors: its determinant is -1", advice)
    return quat_from_matrix(rows)


def _look(value: Any, path: Path, problems: Problems) -> Any:
    """Return the direction that is meant: yaw = left − right, pitch = down − up (REP-103: down is positive)."""
    if isinstance(value, str) and value in DIRECTIONS:
        return quat_from_rpy(*DIRECTIONS[value])
    if not isinstance(value, dict):
        message = f"look: {value} is no direction"
        return problems.refuse("TF106", path, message, f"one of {', '.join(DIRECTIONS)}, or {{down: 15 deg}}")
    turns = record(Turns).read(value, path, problems)
    if turns is BROKEN:
        return BROKEN
    for one, other in (("up", "down"), ("left", "right")):
        if one in value and other in value:
            at, also = (*path, one), (*path, other)
            problems.refuse(
                "TF107", at, f"look has both {one} and {other}", "give one of them", on_key=True, other=also
            )
    pitch, yaw = (turns.down or 0.0) - (turns.up or 0.0), (turns.left or 0.0) - (turns.right or 0.0)
    return quat_from_rpy(turns.roll, pitch, yaw)


RPY = then(listing(ANGLE_, count=3, sample="[0, 15 deg, 0]"), lambda rpy, _path, _problems: quat_from_rpy(*rpy))
QUAT_XYZW = then(listing(NUMBER_, count=4, sample="[0, 0, 0, 1]"), _unit)
MATRIX = then(listing(NUMBERS, count=3, sample="[[1, 0, 0], [0, 1, 0], [0, 0, 1]]"), _rotation_matrix)
AXIS_ANGLE = then(record(AxisAngle), lambda turn, _path, _problems: quat_from_axis_angle(turn.axis, turn.angle))
LOOK = Type(_look, {"anyOf": [{"enum": list(DIRECTIONS)}, Turns]})
