"""How far one pose is from another, in millimetres and degrees."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from tfcompose.pose import Pose, multiply, normalised

if TYPE_CHECKING:
    from tfcompose.pose import Quaternion


class Offset(NamedTuple):
    """A distance in metres, and the angle of the one rotation between two orientations, in radians, 0 to π."""

    xyz_m: float
    rot_rad: float

    @property
    def text(self) -> str:
        """Both in millimetres and degrees, without what is nothing."""
        parts = [f"{self.xyz_m * 1e3:.3g} mm"] if self.xyz_m >= _NO_MM else []
        parts += [f"{math.degrees(self.rot_rad):.3g} deg"] if self.rot_rad >= _NO_RAD else []
        return " and ".join(parts) or "nothing"


_NO_MM, _NO_RAD = 1e-6, 1e-6


def offset_of(expected: Pose, seen: Pose) -> Offset:
    """Return how far ``seen`` is from ``expected``; quaternions need not be of length 1."""
    x, y, z, w = normalised(expected.quat_xyzw)
    back: Quaternion = (-x, -y, -z, w)
    dx, dy, dz, dw = multiply(back, normalised(seen.quat_xyzw))
    # Exact for small angles, as acos is not.
    angle = 2 * math.atan2(math.sqrt(dx * dx + dy * dy + dz * dz), abs(dw))
    return Offset(math.dist(expected.xyz, seen.xyz), angle)


def shown(pose: Pose) -> str:
    """Return the pose in one line: metres, and fixed-axis angles in degrees."""
    xyz = " ".join(f"{round(value, 5) + 0.0:g}" for value in pose.xyz)
    angles = Pose(pose.xyz, normalised(pose.quat_xyzw)).rpy
    rpy = " ".join(f"{round(math.degrees(angle), 3) + 0.0:g}" for angle in angles)
    return f"xyz {xyz} m, rpy {rpy} deg"
