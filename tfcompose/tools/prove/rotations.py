"""Rotations that fit measured directions, as matrices of shape (3, 3)."""

from __future__ import annotations

import math
from itertools import permutations, product
from typing import TYPE_CHECKING

import numpy as np

from tfcompose.foundation.geometry import matrix_from_quat, quat_from_matrix, rpy_from_quat

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from tfcompose.foundation.geometry import Quaternion

    Array = NDArray[np.float64]

UP = np.array([0.0, 0.0, 1.0])
#: The largest angle in radians at which ``snap`` replaces a rotation by quarter turns of the
#: declared mount.
_SNAP_RAD = math.radians(10)


def describe_rotation(quat_xyzw: Quaternion) -> str:
    """Return a rotation as roll, pitch and yaw in degrees."""
    angles = (round(math.degrees(angle), 1) + 0.0 for angle in rpy_from_quat(quat_xyzw))
    return f"rpy: [{', '.join(f'{angle:g} deg' for angle in angles)}]"


def matrix_of(quat_xyzw: Quaternion) -> Array:
    """Return the rotation matrix, shape (3, 3)."""
    return np.array(matrix_from_quat(quat_xyzw))


def quat_of(rotation: Array) -> Quaternion:
    """Return the unit quaternion, xyzw, of a matrix."""
    rows = tuple((float(row[0]), float(row[1]), float(row[2])) for row in rotation)
    return quat_from_matrix((rows[0], rows[1], rows[2]))


def angle_of(a: Array, b: Array) -> float:
    """Return the angle between two vectors, in radians."""
    return math.atan2(float(np.linalg.norm(np.cross(a, b))), float(a @ b))


def rotation_between(a: Array, b: Array) -> float:
    """Return the angle of the rotation from one matrix to another, in radians."""
    return math.acos(float(np.clip((np.trace(a.T @ b) - 1) / 2, -1, 1)))


def frame_of(forward: Array, up: Array) -> Array:
    """Return the rotation that maps two directions of a frame to x and z of the base."""
    left = np.cross(up, forward)
    left /= np.linalg.norm(left)
    return np.vstack([np.cross(left, up), left, up])


def rotation_of(vector: Array) -> Array:
    """Return the matrix of a rotation vector, whose length is the angle (Rodrigues' formula)."""
    angle = float(np.linalg.norm(vector))
    x, y, z = vector / max(angle, 1e-12)
    skew = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    rotation: Array = np.identity(3) + math.sin(angle) * skew + (1 - math.cos(angle)) * skew @ skew
    return rotation


def level(rotation: Array, up: Array) -> Array:
    """Return the rotation nearest to ``rotation`` that maps ``up`` to z.

    If ``up`` maps to -z, the nearest rotation is not unique; the half turn is then about x, which
    is usual.
    """
    begin = rotation @ up
    axis = np.cross(begin, UP)
    sine, cosine = float(np.linalg.norm(axis)), float(begin @ UP)
    if sine < 1e-9:  # noqa: PLR2004 (rounding: there is nothing to change, or any axis would do)
        return rotation if cosine > 0 else np.diag([1.0, -1.0, -1.0]) @ rotation
    leveled: Array = rotation_of(axis / sine * math.atan2(sine, cosine)) @ rotation
    return leveled


def snap(rotation: Array, declared: Array, up: Array, limit_rad: float) -> Array:
    """Replace a rotation by a nearby rotation by quarter turns, if that also fits.

    The quarter turns start from the declared mount or from the axes of the base. A rotation fits
    if it maps ``up`` to z within ``limit_rad``.
    """
    near = min(
        (
            candidate
            for quarter in _quarter_rotations()
            for candidate in (quarter @ declared, quarter)
        ),
        key=lambda candidate: rotation_between(candidate, rotation),
    )
    limit = max(limit_rad, _SNAP_RAD)
    if rotation_between(near, rotation) > limit or angle_of(near @ up, UP) > limit_rad:
        return rotation
    return near


def _quarter_rotations() -> Iterator[Array]:
    """Yield the 24 rotations by quarter turns about the axes of a frame."""
    for order in permutations(range(3)):
        for signs in product((1.0, -1.0), repeat=3):
            matrix = np.zeros((3, 3))
            matrix[range(3), order] = signs
            if np.linalg.det(matrix) > 0:
                yield matrix
