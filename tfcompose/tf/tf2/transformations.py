"""Rotations as Euler angles, quaternions and matrices: the functions of tf_transformations.

This module requires numpy. A program replaces its import by ``from tfcompose.tf.tf2 import
transformations as tf_transformations``. Quaternions are x y z w, angles are in radians, and
matrices are homogeneous, 4×4. ``axes`` names an order of rotations: ``s`` for fixed (static) axes
or ``r`` for axes that rotate with the frame, followed by three axes. The default ``sxyz`` is roll,
pitch and yaw as in URDF and tf2's ``setRPY``.
"""

from __future__ import annotations

from math import acos, atan2, cos, hypot, sin
from typing import TYPE_CHECKING, Any

import numpy as np

from tfcompose.foundation.geometry import (
    Quaternion,
    Vector,
    matrix_from_quat,
    quat_from_axis_angle,
    quat_from_matrix,
)
from tfcompose.tf.tf2.poses import product

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike, NDArray

    Floats = NDArray[np.float64]
    Numbers = Sequence[float] | Floats

_AXES = "xyz"
# A number below this is a rounding error: two rotations count as equal, or a rotation as the
# identity.
_ROUNDING = 4 * np.finfo(float).eps


# Euler angles.


def quaternion_from_euler(ai: float, aj: float, ak: float, axes: str = "sxyz") -> Quaternion:
    """Return the rotation by three angles about the axes, in their order."""
    _, order = _order(axes)
    quat: Quaternion = (0.0, 0.0, 0.0, 1.0)
    for axis, angle in zip(order, (ai, aj, ak), strict=True):
        step = [0.0, 0.0, 0.0, cos(angle / 2)]
        step[axis] = sin(angle / 2)
        quat = (
            quaternion_multiply(step, quat) if axes[0] == "s" else quaternion_multiply(quat, step)
        )
    return quat


def euler_from_quaternion(quaternion: Numbers, axes: str = "sxyz") -> Vector:
    """Return the three angles of the quaternion's rotation."""
    return euler_from_matrix(quaternion_matrix(quaternion), axes)


def euler_matrix(ai: float, aj: float, ak: float, axes: str = "sxyz") -> Floats:
    """Return the rotation by three angles as a matrix."""
    return quaternion_matrix(quaternion_from_euler(ai, aj, ak, axes))


def euler_from_matrix(matrix: ArrayLike, axes: str = "sxyz") -> Vector:
    """Return the three angles of the rotation in a matrix, 3×3 or 4×4.

    The middle angle is from 0 to π if the first axis is also the last, otherwise from −π/2 to π/2.
    At the ends of these ranges, only the sum or the difference of the other angles is determined.
    Then the last angle for fixed axes, or the first for rotating axes, is 0. (Shoemake, Graphics
    Gems IV, 1994.)
    """
    fixed, order = _order(axes)
    rotation = np.asarray(matrix, float)[:3, :3]
    # Rotations about rotating axes equal rotations about fixed axes in the opposite order.
    i, j, last = order if fixed else order[::-1]
    k = 3 - i - j
    sign = 1.0 if (i + 1) % 3 == j else -1.0
    if last == i:
        flat = hypot(rotation[i, j], rotation[i, k])
        middle = atan2(flat, rotation[i, i])
        first, third = (
            atan2(rotation[i, j], sign * rotation[i, k]),
            atan2(rotation[j, i], -sign * rotation[k, i]),
        )
    else:
        flat = hypot(rotation[i, i], rotation[j, i])
        middle = atan2(-sign * rotation[k, i], flat)
        first, third = (
            atan2(sign * rotation[k, j], rotation[k, k]),
            atan2(sign * rotation[j, i], rotation[i, i]),
        )
    if flat < _ROUNDING:
        first, third = atan2(-sign * rotation[j, k], rotation[j, j]), 0.0
    return (first, middle, third) if fixed else (third, middle, first)


def _order(axes: str) -> tuple[bool, list[int]]:
    """Return whether the axes are fixed, and the axes: 0, 1 and 2 for x, y and z.

    Raises:
        ValueError: if it is not an order of rotations.
    """
    order = [_AXES.find(axis) for axis in axes[1:]]
    if (
        axes[:1] not in tuple("sr")
        or len(order) != len(_AXES)
        or -1 in order
        or order[1] in {order[0], order[2]}
    ):
        raise ValueError(
            f"{axes!r} is not an order of rotations: s or r and three axes, such as sxyz or rzyx"
        )
    return axes[0] == "s", order


# Quaternions.


def quaternion_about_axis(angle: float, axis: Numbers) -> Quaternion:
    """Return the rotation by an angle about an axis of any length."""
    x, y, z = axis
    return quat_from_axis_angle((x, y, z), angle)


def quaternion_multiply(quaternion1: Numbers, quaternion0: Numbers) -> Quaternion:
    """Return the product: the second rotation followed by the first, without normalisation."""
    a, b = _four(quaternion1), _four(quaternion0)
    x, y, z, w = product((0.0, 0.0, 0.0, *a), (0.0, 0.0, 0.0, *b))[3:]
    return x, y, z, w


def quaternion_conjugate(quaternion: Numbers) -> Floats:
    """Return the quaternion with x, y and z negated."""
    return np.array([-1.0, -1.0, -1.0, 1.0]) * quaternion


def quaternion_inverse(quaternion: Numbers) -> Floats:
    """Return the quaternion whose product with this one is 0 0 0 1."""
    inverse: Floats = quaternion_conjugate(quaternion) / np.dot(quaternion, quaternion)
    return inverse


def quaternion_slerp(
    quat0: Numbers, quat1: Numbers, fraction: float, spin: int = 0, shortestpath: bool = True  # noqa: FBT001, FBT002 (tf_transformations')
) -> Floats:  # fmt: skip
    """Return the rotation at a fraction, 0 to 1, between two rotations.

    ``spin`` adds half rotations.
    """
    begin, end = unit_vector(quat0), unit_vector(quat1)
    if fraction in {0.0, 1.0}:
        return end if fraction else begin
    dot = float(begin @ end)
    if shortestpath and dot < 0:
        dot, end = -dot, -end
    angle = acos(min(1.0, max(-1.0, dot))) + spin * np.pi
    if abs(abs(dot) - 1) < _ROUNDING or abs(angle) < _ROUNDING:
        return begin
    interpolated: Floats = (
        sin((1 - fraction) * angle) * begin + sin(fraction * angle) * end
    ) / sin(angle)
    return interpolated


def quaternion_matrix(quaternion: Numbers) -> Floats:
    """Return the rotation as a matrix. A quaternion of zeros counts as no rotation."""
    quat = np.asarray(quaternion, float)
    length = np.linalg.norm(quat)
    matrix = np.identity(4)
    if length > _ROUNDING:
        matrix[:3, :3] = matrix_from_quat(_four((quat / length).tolist()))
    return matrix


def quaternion_from_matrix(matrix: ArrayLike) -> Quaternion:
    """Return the rotation of a homogeneous matrix; w is not negative."""
    rows = np.asarray(matrix, float)[:3, :3].tolist()
    x, y, z, w = quat_from_matrix((tuple(rows[0]), tuple(rows[1]), tuple(rows[2])))
    return (x, y, z, w) if w >= 0 else (-x, -y, -z, -w)


def _four(quaternion: Numbers) -> Quaternion:
    x, y, z, w = quaternion
    return x, y, z, w


# Matrices and vectors.


def identity_matrix() -> Floats:
    """Return the identity matrix."""
    return np.identity(4)


def translation_matrix(direction: Numbers) -> Floats:
    """Return the matrix that translates by x y z."""
    matrix = np.identity(4)
    matrix[:3, 3] = direction[:3]
    return matrix


def translation_from_matrix(matrix: ArrayLike) -> Floats:
    """Return the translation x y z of a matrix."""
    moved: Floats = np.array(matrix, float)[:3, 3]
    return moved


def rotation_matrix(angle: float, direction: Numbers, point: Numbers | None = None) -> Floats:
    """Return the rotation by an angle about an axis, through the origin or another point."""
    matrix = quaternion_matrix(quaternion_about_axis(angle, direction))
    if point is not None:
        origin = np.array(point[:3], float)
        matrix[:3, 3] = origin - matrix[:3, :3] @ origin
    return matrix


def inverse_matrix(matrix: ArrayLike) -> Floats:
    """Return the inverse of a square matrix."""
    inverse: Floats = np.linalg.inv(np.asarray(matrix, float))
    return inverse


def concatenate_matrices(*matrices: ArrayLike) -> Floats:
    """Return the product of the matrices, from left to right."""
    product: Floats = np.identity(4)
    for matrix in matrices:
        product = product @ np.asarray(matrix, float)
    return product


def is_same_transform(matrix0: ArrayLike, matrix1: ArrayLike) -> bool:
    """Return whether two homogeneous matrices, each at any scale, are the same transform."""
    first, second = np.asarray(matrix0, float), np.asarray(matrix1, float)
    return bool(np.allclose(first / first[3, 3], second / second[3, 3]))


def vector_norm(data: ArrayLike, axis: int | None = None) -> Any:
    """Return the Euclidean length, of the whole array or along an axis."""
    return np.linalg.norm(np.asarray(data, float), axis=axis)


def unit_vector(data: ArrayLike, axis: int | None = None) -> Floats:
    """Return the array scaled to length 1, as one vector or along an axis."""
    vector = np.array(data, float)
    length = np.linalg.norm(vector, axis=axis, keepdims=axis is not None)
    unit: Floats = vector / length
    return unit
