"""Poses as seven plain numbers, for computations many times a second.

The numbers are x y z in metres and the quaternion x y z w. ``tfcompose.foundation.geometry.Pose``
has the same arithmetic with a type. It normalises quaternions at every step; this module does so
only at the end. The functions also accept numpy arrays for the numbers, and then compute many
poses at once.
"""

from __future__ import annotations

from math import acos, sin, sqrt
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

#: x y z in metres, quaternion x y z w.
PoseTuple = tuple[float, float, float, float, float, float, float]

IDENTITY: PoseTuple = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)

# Above this cosine, the chord and the arc between two unit quaternions agree to the last bits.
_CHORD = 1 - 1e-9


def product(a: PoseTuple, b: PoseTuple) -> PoseTuple:
    """Return the pose of C in A: the pose of B in A times the pose of C in B."""
    px, py, pz, ax, ay, az, aw = a
    x, y, z, bx, by, bz, bw = b
    tx, ty, tz = 2 * (ay * z - az * y), 2 * (az * x - ax * z), 2 * (ax * y - ay * x)
    return (
        px + x + aw * tx + ay * tz - az * ty,
        py + y + aw * ty + az * tx - ax * tz,
        pz + z + aw * tz + ax * ty - ay * tx,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def inverse_product(a: PoseTuple, b: PoseTuple) -> PoseTuple:
    """Return the pose of C in B, from the poses of B in A and of C in A."""
    px, py, pz, ax, ay, az, aw = a
    x, y, z, bx, by, bz, bw = b
    x, y, z = x - px, y - py, z - pz
    tx, ty, tz = 2 * (az * y - ay * z), 2 * (ax * z - az * x), 2 * (ay * x - ax * y)
    return (
        x + aw * tx + az * ty - ay * tz,
        y + aw * ty + ax * tz - az * tx,
        z + aw * tz + ay * tx - ax * ty,
        aw * bx - ax * bw - ay * bz + az * by,
        aw * by + ax * bz - ay * bw - az * bx,
        aw * bz - ax * by + ay * bx - az * bw,
        aw * bw + ax * bx + ay * by + az * bz,
    )


def inverse(a: PoseTuple) -> PoseTuple:
    """Return the pose of A in B from the pose of B in A."""
    return inverse_product(a, IDENTITY)


def unit(a: PoseTuple) -> PoseTuple:
    """Return the pose with a quaternion of length 1 and w ≥ 0.

    Of the two quaternions for a rotation, this is the one with the smaller angle.
    """
    x, y, z, qx, qy, qz, qw = a
    squared = qx * qx + qy * qy + qz * qz + qw * qw
    if qw >= 0 and -4e-16 < squared - 1.0 < 4e-16:  # noqa: PLR2004 (the rounding of the sum)
        return a
    scale = 1 / sqrt(squared) if qw >= 0 else -1 / sqrt(squared)
    return (x, y, z, qx * scale, qy * scale, qz * scale, qw * scale)


def between(two: Sequence[float], part: float) -> PoseTuple:
    """Return the pose at the fraction ``part`` (0 to 1) between two poses, given as 14 numbers.

    Positions are interpolated linearly and rotations on the great circle, the short way (Shoemake,
    1985), as in tf2.
    """
    ax, ay, az, aqx, aqy, aqz, aqw, bx, by, bz, bqx, bqy, bqz, bqw = two
    dot = aqx * bqx + aqy * bqy + aqz * bqz + aqw * bqw
    cosine = -dot if dot < 0 else dot
    p, q = 1 - part, part
    if cosine < _CHORD:
        angle = acos(cosine)
        per_sine = 1 / sin(angle)
        p, q = sin(p * angle) * per_sine, sin(part * angle) * per_sine
    if dot < 0:
        q = -q
    return (
        ax + (bx - ax) * part,
        ay + (by - ay) * part,
        az + (bz - az) * part,
        p * aqx + q * bqx,
        p * aqy + q * bqy,
        p * aqz + q * bqz,
        p * aqw + q * bqw,
    )
