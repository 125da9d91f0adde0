"""Angles and rotations as people write them: in degrees where that is exact, and else with all digits."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from tfcompose.emit.flow import Bare
from tfcompose.geometry import Pose, angle_between, quat_from_rpy
from tfcompose.numbers import clean_rpy, number

if TYPE_CHECKING:
    from tfcompose.geometry import Quaternion, Vector

#: A whole number of degrees, or one of few decimals, is what was meant if the angle (rad) is so near.
MEANT_RAD = 5e-13
#: And a rotation is the one that was written if it is so near; half an angle's error remains in a quaternion.
SAME_RAD = 1e-12
_DECIMALS = 4


def angle(value: float) -> Bare | float:
    """Return the angle (rad) as it is written: ``-90 deg``, or radians."""
    degrees = round(math.degrees(value), _DECIMALS) + 0.0
    if abs(math.radians(degrees) - value) > MEANT_RAD:
        return value
    return Bare(f"{number(degrees)} deg") if degrees else 0.0


def read(written: Bare | float) -> float:
    """Return the angle in radians that is written."""
    return math.radians(float(written.removesuffix(" deg"))) if isinstance(written, Bare) else written


def turn(quat_xyzw: Quaternion, said: Vector | None = None) -> list[Bare | float] | None:
    """Return roll, pitch and yaw as they are written, or None for no turn; ``said`` is how the source has it."""
    if quat_xyzw == Pose().quat_xyzw:
        return None
    rpy = said or clean_rpy(quat_xyzw)
    written = [angle(value) for value in rpy]
    roll, pitch, yaw = map(read, written)
    if angle_between(quat_from_rpy(roll, pitch, yaw), quat_xyzw) > SAME_RAD:
        return list(rpy)
    return written if any(written) else None
