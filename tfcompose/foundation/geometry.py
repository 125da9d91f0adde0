"""Poses of child frames in their parents.

A ``Pose`` is the pose of B in A. It maps coordinates in B to coordinates in A. Rotations are unit
quaternions in the order x, y, z, w. Axes follow REP-103 (x forward, y left, z up). Roll, pitch and
yaw are rotations about the *fixed* axes x, y, z in this order, as in URDF and tf2's ``setRPY``.
"""

from __future__ import annotations

import math
from typing import NamedTuple

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
Matrix = tuple[Vector, Vector, Vector]

IDENTITY_XYZW: Quaternion = (0.0, 0.0, 0.0, 1.0)

# The pose of a camera's optical frame (z forward, x right, y down: REP-103) in its body frame (x
# forward, z up).
OPTICAL_XYZW: Quaternion = (-0.5, 0.5, -0.5, 0.5)


class Pose(NamedTuple):
    """The pose of B in A."""

    #: In metres.
    xyz: Vector = (0.0, 0.0, 0.0)
    #: A unit quaternion.
    quat_xyzw: Quaternion = IDENTITY_XYZW

    def __matmul__(self, c_in_b: Pose) -> Pose:
        """Return the pose of C in A: this pose of B in A, times the pose of C in B."""
        x, y, z = rotate(self.quat_xyzw, c_in_b.xyz)
        xyz = (self.xyz[0] + x, self.xyz[1] + y, self.xyz[2] + z)
        return Pose(xyz, multiply(self.quat_xyzw, c_in_b.quat_xyzw))

    def inverse(self) -> Pose:
        """Return the pose of A in B."""
        x, y, z, w = self.quat_xyzw
        back = (-x, -y, -z, w)
        tx, ty, tz = rotate(back, self.xyz)
        return Pose((-tx, -ty, -tz), back)

    @property
    def rpy(self) -> Vector:
        """Roll, pitch and yaw in radians about the fixed axes. At pitch ±π/2 the roll is 0."""
        return rpy_from_quat(self.quat_xyzw)


def multiply(a: Quaternion, b: Quaternion) -> Quaternion:
    """Return the quaternion of rotation ``b`` followed by ``a`` (Hamilton product a·b)."""
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return normalise(
        (
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
            aw * bw - ax * bx - ay * by - az * bz,
        )
    )


def rotate(quat_xyzw: Quaternion, xyz: Vector) -> Vector:
    """Return ``xyz`` rotated by the quaternion: v + 2w(q × v) + 2q × (q × v)."""
    x, y, z, w = quat_xyzw
    vx, vy, vz = xyz
    tx, ty, tz = 2 * (y * vz - z * vy), 2 * (z * vx - x * vz), 2 * (x * vy - y * vx)
    return (
        vx + w * tx + y * tz - z * ty,
        vy + w * ty + z * tx - x * tz,
        vz + w * tz + x * ty - y * tx,
    )


def norm(values: tuple[float, ...]) -> float:
    """Return the Euclidean length."""
    return math.hypot(*values)


def normalise(quat_xyzw: Quaternion) -> Quaternion:
    """Return the quaternion scaled to unit length.

    A quaternion of exactly unit length is returned unchanged.

    Raises:
        ZeroDivisionError: if all four components are 0.
    """
    length = norm(quat_xyzw)
    if length == 1.0:
        return quat_xyzw
    x, y, z, w = quat_xyzw
    return (x / length, y / length, z / length, w / length)


def quat_from_rpy(roll: float, pitch: float, yaw: float) -> Quaternion:
    """Return Rz(yaw)·Ry(pitch)·Rx(roll), in radians: the convention of URDF and setRPY."""
    cr, sr = math.cos(roll / 2), math.sin(roll / 2)
    cp, sp = math.cos(pitch / 2), math.sin(pitch / 2)
    cy, sy = math.cos(yaw / 2), math.sin(yaw / 2)
    return normalise(
        (
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
            cr * cp * cy + sr * sp * sy,
        )
    )


def rpy_from_quat(quat_xyzw: Quaternion) -> Vector:
    """Return roll, pitch, yaw in radians about fixed axes.

    At pitch ±π/2 only yaw ∓ roll is defined, and roll is 0. Near ±π/2, yaw has few significant
    digits. Roll is computed from the remaining rotation, so that the three angles together give
    the exact rotation.
    """
    (r00, r01, _), (r10, r11, _), (r20, _, _) = matrix_from_quat(quat_xyzw)
    horizontal = math.hypot(r00, r10)
    if horizontal < 1e-9:  # noqa: PLR2004 (below the rounding of a unit quaternion's matrix)
        return (0.0, math.atan2(-r20, horizontal), math.atan2(-r01, r11))
    pitch, yaw = math.atan2(-r20, horizontal), math.atan2(r10, r00)
    x, y, z, w = quat_from_rpy(0.0, pitch, yaw)
    rotation = multiply((-x, -y, -z, w), quat_xyzw)
    sign = 1.0 if rotation[3] >= 0 else -1.0
    return (2 * math.atan2(sign * rotation[0], sign * rotation[3]), pitch, yaw)


def quat_from_axis_angle(axis: Vector, angle: float) -> Quaternion:
    """Return the right-handed rotation by ``angle`` radians about ``axis`` of any length but 0.

    Raises:
        ZeroDivisionError: if the axis has length 0.
    """
    length = norm(axis)
    s = math.sin(angle / 2) / length
    return normalise((axis[0] * s, axis[1] * s, axis[2] * s, math.cos(angle / 2)))


def matrix_from_quat(quat_xyzw: Quaternion) -> Matrix:
    """Return the 3×3 rotation matrix as rows; column i is the child's axis i in the parent."""
    x, y, z, w = quat_xyzw
    return (
        (1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
        (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
        (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
    )


def quat_from_matrix(rows: Matrix) -> Quaternion:
    """Return the quaternion of a rotation matrix given as rows.

    Of the four formulas, the function uses the one with the largest divisor (Shepperd, 1978), so
    that half turns are exact, too.
    """
    (r00, r01, r02), (r10, r11, r12), (r20, r21, r22) = rows
    four = (1 + r00 - r11 - r22, 1 - r00 + r11 - r22, 1 - r00 - r11 + r22, 1 + r00 + r11 + r22)
    best = four.index(max(four))
    candidates: tuple[Quaternion, ...] = (
        (four[0], r10 + r01, r02 + r20, r21 - r12),
        (r10 + r01, four[1], r21 + r12, r02 - r20),
        (r02 + r20, r21 + r12, four[2], r10 - r01),
        (r21 - r12, r02 - r20, r10 - r01, four[3]),
    )
    return normalise(candidates[best])


def angle_between(a: Quaternion, b: Quaternion) -> float:
    """Return the angle in radians, 0 to π, of the rotation from ``a`` to ``b``."""
    ax, ay, az, aw = a
    x, y, z, w = multiply((-ax, -ay, -az, aw), b)
    return 2 * math.atan2(norm((x, y, z)), abs(w))


#: Distances in metres and angles in radians below these values are displayed as nothing; and the
#: size of rounding errors.
_NO_MM, _NO_RAD, _ROUNDING = 1e-6, 1e-6, 1e-9


class Offset(NamedTuple):
    """A distance in metres, and the angle between two orientations in radians, 0 to π."""

    xyz_m: float
    rot_rad: float

    @property
    def text(self) -> str:
        """Distance in millimetres and angle in degrees as text, without negligible values."""
        distance = f"{self.xyz_m * 1e3:.3g} mm" if self.xyz_m < 1 else f"{self.xyz_m:.3g} m"
        parts = [distance] if self.xyz_m >= _NO_MM else []
        parts += [f"{math.degrees(self.rot_rad):.3g} deg"] if self.rot_rad >= _NO_RAD else []
        return " and ".join(parts) or "nothing"

    def beyond(self, limit: Offset) -> bool:
        """Return whether the distance or the angle exceeds ``limit`` by more than rounding."""
        return self.xyz_m > limit.xyz_m + _ROUNDING or self.rot_rad > limit.rot_rad + _ROUNDING


def offset_of(expected: Pose, observed: Pose) -> Offset:
    """Return the distance and angle between two poses. Quaternions need not have length 1."""
    angle = angle_between(normalise(expected.quat_xyzw), normalise(observed.quat_xyzw))
    return Offset(math.dist(expected.xyz, observed.xyz), angle)
