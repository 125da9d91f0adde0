"""The functions of tf_transformations against scipy, for every order of axes."""

from itertools import product

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from tfcompose.tf.tf2 import transformations as tf

ORDERS = [
    kind + "".join(axes)
    for kind, *axes in product("sr", "xyz", "xyz", "xyz")
    if axes[0] != axes[1] and axes[1] != axes[2]
]
RNG = np.random.default_rng(7)
ANGLES = [
    *RNG.uniform(-7, 7, (10, 3)),
    *([1.0, middle, 2.0] for middle in (0.0, np.pi / 2, -np.pi / 2, np.pi)),
]


def rotation(angles: object, order: str) -> Rotation:
    return Rotation.from_euler(order[1:] if order[0] == "s" else order[1:].upper(), angles)


def away(quat: object, expected: Rotation) -> float:
    return float((Rotation.from_quat(quat) * expected.inv()).magnitude())


@pytest.mark.parametrize("order", ORDERS)
def test_an_order_of_rotations_gives_the_quaternion_and_back_the_angles(order: str) -> None:
    for angles in ANGLES:
        expected, (i, j, k) = rotation(angles, order), angles
        quat = tf.quaternion_from_euler(i, j, k, order)
        assert away(quat, expected) < 1e-12
        assert np.allclose(tf.euler_matrix(i, j, k, order)[:3, :3], expected.as_matrix())
        back = tf.euler_from_quaternion(quat, order)
        low, high = (0.0, np.pi) if order[1] == order[3] else (-np.pi / 2, np.pi / 2)
        assert low - 1e-9 <= back[1] <= high + 1e-9
        assert away(tf.quaternion_from_euler(*back, order), expected) < 1e-7


def test_all_orders_are_there_and_no_other() -> None:
    assert len(ORDERS) == 24
    for wrong in ("", "xyz", "sxxy", "sxy", "sxyzx", "txyz", "sxyw"):
        with pytest.raises(ValueError, match="order"):
            tf.quaternion_from_euler(0, 0, 0, wrong)


def test_the_default_is_roll_pitch_and_yaw_about_fixed_axes() -> None:
    assert (
        away(
            tf.quaternion_from_euler(0.1, -0.2, 0.3), Rotation.from_euler("xyz", (0.1, -0.2, 0.3))
        )
        < 1e-12
    )
    assert tf.euler_from_quaternion(tf.quaternion_from_euler(0.1, -0.2, 0.3)) == pytest.approx(
        (0.1, -0.2, 0.3)
    )


def test_quaternions_are_multiplied_inverted_and_interpolated() -> None:
    a, b = Rotation.random(2, random_state=3)
    assert away(tf.quaternion_multiply(a.as_quat(), b.as_quat()), a * b) < 1e-12
    assert tf.quaternion_multiply((0, 0, 0, 2), (0, 0, 3, 4)) == (0, 0, 6, 8), (
        "nothing is normalised"
    )
    assert tf.quaternion_multiply(
        tf.quaternion_inverse((0, 0, 3, 4)), (0, 0, 3, 4)
    ) == pytest.approx((0, 0, 0, 1))
    assert tf.quaternion_conjugate((1, 2, 3, 4)).tolist() == [-1, -2, -3, 4]
    way = Slerp([0, 1], Rotation.concatenate([a, b]))
    for fraction in (0.0, 0.3, 1.0):
        for quat_xyzw in (b.as_quat(), -b.as_quat()):
            assert (
                away(tf.quaternion_slerp(a.as_quat(), quat_xyzw, fraction), way(fraction)) < 1e-9
            )
    assert tf.quaternion_slerp((0, 0, 0, 2), (0, 0, 0, 1), 0.5).tolist() == [0, 0, 0, 1]
    long_way = tf.quaternion_slerp((0, 0, 0, 1), (0, 0, -0.6, -0.8), 0.5, shortestpath=False)
    assert away(long_way, Rotation.from_rotvec((0, 0, np.arctan2(0.6, 0.8) - np.pi))) < 1e-9


def test_matrices_are_made_and_taken_apart() -> None:
    rotated, shift = tf.rotation_matrix(0.7, (0, 0, 5)), tf.translation_matrix((1, 2, 3))
    assert np.allclose(rotated[:3, :3], Rotation.from_rotvec((0, 0, 0.7)).as_matrix())
    both = tf.concatenate_matrices(shift, rotated)
    assert np.allclose(both, shift @ rotated)
    assert tf.translation_from_matrix(both).tolist() == [1, 2, 3]
    assert away(tf.quaternion_from_matrix(both), Rotation.from_rotvec((0, 0, 0.7))) < 1e-12
    for angle in (-3.1, -0.7, 0.7, 3.1):
        quat = tf.quaternion_from_matrix(tf.rotation_matrix(angle, (1, -2, 3)))
        assert quat[3] >= 0
        assert away(quat, Rotation.from_rotvec(angle * np.array([1, -2, 3]) / np.sqrt(14))) < 1e-12
    assert (
        away(tf.quaternion_about_axis(0.7, (0, 0, 5)), Rotation.from_rotvec((0, 0, 0.7))) < 1e-12
    )
    assert np.allclose(
        tf.concatenate_matrices(tf.inverse_matrix(both), both), tf.identity_matrix()
    )
    assert np.allclose(
        tf.rotation_matrix(0.7, (0, 0, 1), (1, 2, 3)) @ (1, 2, 3, 1), (1, 2, 3, 1)
    ), "its point stays"
    assert tf.is_same_transform(both, 2 * both)
    assert not tf.is_same_transform(both, rotated)
    assert tf.quaternion_matrix((0, 0, 0, 0)).tolist() == np.identity(4).tolist()
    assert np.allclose(tf.quaternion_matrix((0, 0, 3, 4)), tf.quaternion_matrix((0, 0, 0.6, 0.8)))


def test_vectors_have_a_length_and_a_direction() -> None:
    assert tf.vector_norm((3, 4)) == 5.0
    assert tf.vector_norm([[3, 4], [6, 8]], axis=1).tolist() == [5, 10]
    assert tf.unit_vector((3, 4)).tolist() == [0.6, 0.8]
    assert tf.unit_vector([[3, 4], [0, 2]], axis=1).tolist() == [[0.6, 0.8], [0, 1]]
