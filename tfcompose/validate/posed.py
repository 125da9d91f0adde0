"""A pose as users write it: a position, and one rotation out of five ways to say it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.validate.fields import XYZ
from tfcompose.validate.rotation import AXIS_ANGLE, LOOK, MATRIX, QUAT_XYZW, RPY
from tfcompose.validate.schema import Model, key

if TYPE_CHECKING:
    from tfcompose.geometry import Quaternion, Vector


class Turned(Model):
    """At most one rotation of the child in its parent."""

    rpy: Quaternion | None = key(RPY, None, "roll, pitch, yaw about fixed axes; looking down is positive pitch")
    quat_xyzw: Quaternion | None = key(QUAT_XYZW, None, "a unit quaternion in the order x, y, z, w")
    axis_angle: Quaternion | None = key(AXIS_ANGLE, None, "a turn about an axis, right-handed")
    matrix: Quaternion | None = key(MATRIX, None, "3×3 rows; column i is the child's axis i in the parent")
    look: Quaternion | None = key(LOOK, None, "what is meant, not its sign", ("down", {"down": "15 deg"}))


class Posed(Turned):
    """A pose: where the child is, in its parent."""

    xyz: Vector = key(XYZ, (0.0, 0.0, 0.0), "x forward, y left, z up", ([0.2, 0, "30 cm"],))
