"""The only writer of numbers: the shortest text that reads back as the same number.

There is no −0, and rounding noise is removed.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING

from tfcompose.foundation.geometry import (
    Pose,
    angle_between,
    matrix_from_quat,
    multiply,
    quat_from_rpy,
    rpy_from_quat,
)

if TYPE_CHECKING:
    from tfcompose.foundation.geometry import Quaternion, Vector

METRE_DECIMALS = 12
QUATERNION_DECIMALS = 14
ANGLE_NOISE_RAD = 1e-12
NEAR_UPRIGHT_RAD = 1e-6


#: Cache size. The same numbers and rotations occur many times.
_REMEMBERED = 1 << 16


@lru_cache(maxsize=_REMEMBERED)
def number(value: float) -> str:
    """Return the number as text, such as ``0.3``, ``1`` or ``1e-05``."""
    value = value + 0.0  # −0 becomes 0
    return str(int(value)) if value.is_integer() and abs(value) < 2**53 else repr(value)


def numbers(values: tuple[float, ...]) -> str:
    """Return the numbers as text separated by spaces, as in URDF."""
    return " ".join(map(number, values))


@lru_cache(maxsize=_REMEMBERED)
def clean_xyz(xyz: Vector) -> Vector:
    """Return the lengths in metres rounded to a picometre, which removes rounding noise."""
    x, y, z = xyz
    return (
        round(x, METRE_DECIMALS) + 0.0,
        round(y, METRE_DECIMALS) + 0.0,
        round(z, METRE_DECIMALS) + 0.0,
    )


@lru_cache(maxsize=_REMEMBERED)
def clean_quat(quat_xyzw: Quaternion) -> Quaternion:
    """Return the quaternion rounded to 14 decimals, so that equal rotations have equal texts.

    A quaternion and its negative are the same rotation. The result is the one with positive w, or,
    if w is 0, with a positive first nonzero component.
    """
    x, y, z, w = (round(value, QUATERNION_DECIMALS) + 0.0 for value in quat_xyzw)
    if next((value for value in (w, x, y, z) if value), 1.0) < 0:
        x, y, z, w = (0.0 - value for value in (x, y, z, w))
    return (x, y, z, w)


def clean(pose: Pose) -> Pose:
    """Return the pose as written to files."""
    return Pose(clean_xyz(pose.xyz), clean_quat(pose.quat_xyzw))


def clean_rpy(quat_xyzw: Quaternion) -> Vector:
    """Return roll, pitch, yaw in radians.

    Angles within rounding noise of a whole degree become exactly that degree. Near pitch ±π/2, yaw
    has few significant digits, and roll is computed from the remaining rotation.
    """
    x, y, z, w = quat_xyzw
    return _clean_rpy(
        (x + 0.0, y + 0.0, z + 0.0, w + 0.0)
    )  # −0 becomes 0, because the cache cannot distinguish them


@lru_cache(maxsize=_REMEMBERED)
def _clean_rpy(quat_xyzw: Quaternion) -> Vector:
    _, pitch, yaw = (_integer_degree(angle) for angle in rpy_from_quat(quat_xyzw))
    first = _with_roll(pitch, yaw, quat_xyzw)
    if abs(abs(pitch) - math.pi / 2) > NEAR_UPRIGHT_RAD:
        return first
    # This close to ±π/2, the pitch may be on either side of it. Otherwise, roll and yaw would be
    # far from round numbers.
    (r00, _, _), (r10, _, _), (r20, _, _) = matrix_from_quat(quat_xyzw)
    flipped = _with_roll(math.copysign(math.pi, pitch) - pitch, yaw, quat_xyzw)
    exact = _with_roll(math.atan2(-r20, math.hypot(r00, r10)), math.atan2(r10, r00), quat_xyzw)
    off = {rpy: angle_between(quat_from_rpy(*rpy), quat_xyzw) for rpy in (first, flipped, exact)}
    return next(
        (rpy for rpy, angle in off.items() if angle < ANGLE_NOISE_RAD),
        min(off, key=off.__getitem__),
    )


def _with_roll(pitch: float, yaw: float, quat_xyzw: Quaternion) -> Vector:
    """Return the angles, with roll computed from the remaining rotation."""
    x, y, z, w = quat_from_rpy(0.0, pitch, yaw)
    rotation = multiply((-x, -y, -z, w), quat_xyzw)
    roll = 2 * (
        math.atan2(rotation[0], rotation[3])
        if rotation[3] >= 0
        else math.atan2(-rotation[0], -rotation[3])
    )
    return (_integer_degree(roll), pitch, yaw)


def _integer_degree(angle: float) -> float:
    snapped = math.radians(round(math.degrees(angle)))
    return (snapped if abs(angle - snapped) < ANGLE_NOISE_RAD else angle) + 0.0


def clean_tensor(tensor: tuple[float, ...]) -> tuple[float, ...]:
    """Return the moments with 12 significant digits, more than any measurement has."""
    return tuple([float(f"{value:.12g}") for value in tensor])
