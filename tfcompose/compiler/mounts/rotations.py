"""New numbers for a rotation in the form that the file uses, with as few changes as possible.

Each form is a mapping from paths below its key to numbers: ``(0,)`` for ``rpy``, ``("axis", 0)``
for ``axis_angle``, ``("down",)`` for ``look``. If several sets of numbers describe the new
rotation, functions return the set nearest to the old numbers.
"""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING, Any

from tfcompose.foundation.geometry import (
    angle_between,
    matrix_from_quat,
    norm,
    normalise,
    quat_from_rpy,
    rpy_from_quat,
)
from tfcompose.foundation.numbers import clean_rpy

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from tfcompose.foundation.geometry import Quaternion, Vector

Numbers = dict[tuple[str | int, ...], float]
"""Numbers in SI by their path below a key."""

#: Two texts of the same rotation differ by less than this, in radians.
_SAME_RAD = 1e-9
#: If the pitch is this close to ±π/2, in radians, roll and yaw rotate about the same axis.
_UPRIGHT = 1e-7
#: Largest difference to the old axis at which only the angle changes.
_SAME_AXIS = 1e-9


def rpy_near(rotation: Quaternion, old: Vector, tolerance: float) -> Vector:
    """Return roll, pitch and yaw of a rotation, in radians.

    Among equivalent angles, return the set with the fewest changes from ``old``.
    """

    def changes(rpy: Vector) -> tuple[int, float]:
        differences = [abs(new - was) for new, was in zip(rpy, old, strict=True)]
        return sum(difference > tolerance for difference in differences), sum(differences)

    return min(_all_rpy(rotation, old), key=changes)


def _all_rpy(rotation: Quaternion, old: Vector) -> Iterator[Vector]:
    """Yield all equivalent angles of the rotation, each as near as possible to the old angle."""
    exact = rpy_from_quat(rotation)
    candidates = [exact, clean_rpy(rotation)]
    roll, pitch, yaw = exact
    if math.pi / 2 - abs(pitch) < _UPRIGHT:
        sign = math.copysign(1.0, pitch)  # only yaw ∓ roll is determined
        candidates += [
            (old[0], pitch, yaw + sign * (old[0] - roll)),
            (roll + sign * (old[2] - yaw), pitch, old[2]),
        ]
    candidates += [
        (roll + math.pi, math.pi - pitch, yaw + math.pi) for roll, pitch, yaw in candidates
    ]
    for solution in candidates:
        near = tuple(
            new + math.tau * round((was - new) / math.tau)
            for new, was in zip(solution, old, strict=True)
        )
        rpy = (near[0], near[1], near[2])
        if angle_between(quat_from_rpy(*rpy), rotation) < _SAME_RAD:
            yield rpy
    yield exact


def rpy_numbers(rotation: Quaternion, old: Numbers, tolerance: float) -> Numbers:
    """Return the numbers of ``rpy``, in radians."""
    rpy = rpy_near(rotation, (old[0,], old[1,], old[2,]), tolerance)
    return {(index,): angle for index, angle in enumerate(rpy)}


def quat_numbers(rotation: Quaternion, old: Numbers, _tolerance: float) -> Numbers:
    """Return the numbers of ``quat_xyzw``, with the sign that is nearer to the old numbers."""
    sign = math.copysign(1.0, sum(part * old[index,] for index, part in enumerate(rotation)))
    return {(index,): sign * part for index, part in enumerate(rotation)}


def matrix_numbers(rotation: Quaternion, _old: Numbers, _tolerance: float) -> Numbers:
    """Return the numbers of ``matrix``."""
    rows = matrix_from_quat(rotation)
    return {
        (row, column): rows[row][column] for row, column in itertools.product(range(3), range(3))
    }


def axis_angle_numbers(rotation: Quaternion, old: Numbers, _tolerance: float) -> Numbers:
    """Return the numbers of ``axis_angle``. If the axis is the same, only the angle changes."""
    old_axis = (old["axis", 0], old["axis", 1], old["axis", 2])
    length = norm(old_axis)
    x, y, z, w = normalise(rotation)
    half = norm((x, y, z))
    angle, axis = (
        2 * math.atan2(half, w),
        ((x / half, y / half, z / half) if half else (0.0, 0.0, 0.0)),
    )
    along = sum(a * b / length for a, b in zip(axis, old_axis, strict=True))
    sign = math.copysign(1.0, along)
    distance = math.dist([sign * part for part in axis], [part / length for part in old_axis])
    if half < _SAME_AXIS or distance * half < _SAME_AXIS:
        angle *= sign
        axis = old_axis
    was = old["angle",]
    angle += math.tau * round((was - angle) / math.tau)
    return {("axis", 0): axis[0], ("axis", 1): axis[1], ("axis", 2): axis[2], ("angle",): angle}


def direction_numbers(rotation: Quaternion, old: Numbers, tolerance: float) -> Numbers:
    """Return the numbers of ``look`` with angles.

    Existing keys are changed. Other keys are added only if needed.
    """
    up, left = ("up",) in old, ("right",) not in old
    pitch_key, yaw_key = "up" if up else "down", "left" if left else "right"
    pitch_sign, yaw_sign = (-1 if up else 1), (1 if left else -1)
    was = (
        old.get(("roll",), 0.0),
        pitch_sign * old.get((pitch_key,), 0.0),
        yaw_sign * old.get((yaw_key,), 0.0),
    )
    roll, pitch, yaw = rpy_near(rotation, was, tolerance)
    new: Numbers = {(pitch_key,): pitch_sign * pitch, (yaw_key,): yaw_sign * yaw, ("roll",): roll}
    return {path: value for path, value in new.items() if path in old or abs(value) > tolerance}


FORMS: Mapping[str, Any] = {
    "rpy": rpy_numbers,
    "quat_xyzw": quat_numbers,
    "matrix": matrix_numbers,
    "axis_angle": axis_angle_numbers,
    "look": direction_numbers,
}
