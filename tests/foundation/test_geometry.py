"""Poses agree with scipy and are a group."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from tfcompose.foundation.geometry import (
    IDENTITY_XYZW,
    OPTICAL_XYZW,
    Matrix,
    Pose,
    Quaternion,
    Vector,
    angle_between,
    matrix_from_quat,
    multiply,
    norm,
    quat_from_axis_angle,
    quat_from_matrix,
    quat_from_rpy,
    rotate,
    rpy_from_quat,
)

metres = st.floats(-100, 100)
angles = st.floats(-math.pi, math.pi)
vectors = st.tuples(metres, metres, metres)
quaternions = st.tuples(angles, angles, angles).map(lambda rpy: quat_from_rpy(*rpy))
poses = st.builds(Pose, vectors, quaternions)


def close(a: Pose, b: Pose, tolerance: float = 1e-9) -> bool:
    far = norm(tuple(p - q for p, q in zip(a.xyz, b.xyz, strict=True)))
    return far < tolerance and angle_between(a.quat_xyzw, b.quat_xyzw) < tolerance


@given(poses)
def test_a_pose_times_its_inverse_is_the_identity(pose: Pose) -> None:
    assert close(pose @ pose.inverse(), Pose())
    assert close(pose.inverse() @ pose, Pose())


@given(poses, poses, poses)
def test_chaining_is_associative(a: Pose, b: Pose, c: Pose) -> None:
    assert close((a @ b) @ c, a @ (b @ c))


@given(poses, poses)
def test_chaining_agrees_with_scipy(a: Pose, b: Pose) -> None:
    chained = a @ b
    ra, rb = Rotation.from_quat(a.quat_xyzw), Rotation.from_quat(b.quat_xyzw)
    xyz: Vector = tuple(ra.apply(b.xyz) + a.xyz)
    quat: Quaternion = tuple((ra * rb).as_quat())
    assert close(chained, Pose(xyz, quat))


@given(angles, angles, angles)
def test_rpy_is_about_fixed_axes_as_in_urdf(roll: float, pitch: float, yaw: float) -> None:
    expected: Quaternion = tuple(Rotation.from_euler("xyz", [roll, pitch, yaw]).as_quat())
    assert angle_between(quat_from_rpy(roll, pitch, yaw), expected) < 1e-12


@given(quaternions)
def test_rpy_read_back_is_the_same_rotation(quat: Quaternion) -> None:
    assert angle_between(quat_from_rpy(*rpy_from_quat(quat)), quat) < 2e-9


@given(angles, st.floats(1e-12, 1e-3), st.sampled_from([1, -1]), angles)
def test_near_the_pole_rpy_keeps_the_rotation_too(
    roll: float, short_of: float, sign: int, yaw: float
) -> None:
    quat = quat_from_rpy(roll, sign * (math.pi / 2 - short_of), yaw)
    assert angle_between(quat_from_rpy(*rpy_from_quat(quat)), quat) < 2e-9


@pytest.mark.parametrize("pitch", [math.pi / 2, -math.pi / 2])
@pytest.mark.parametrize("yaw", [0.0, 1.0, -2.5])
def test_rpy_at_the_pole_keeps_the_rotation_with_roll_zero(pitch: float, yaw: float) -> None:
    quat = quat_from_rpy(0.3, pitch, yaw)
    assert rpy_from_quat(quat)[0] == 0
    assert angle_between(quat_from_rpy(*rpy_from_quat(quat)), quat) < 1e-7


@given(quaternions)
def test_matrix_agrees_with_scipy_and_reads_back(quat: Quaternion) -> None:
    r0, r1, r2 = (tuple(row) for row in Rotation.from_quat(quat).as_matrix().tolist())
    rows: Matrix = (r0, r1, r2)
    for mine, theirs in zip(matrix_from_quat(quat), rows, strict=True):
        assert mine == pytest.approx(theirs, abs=1e-12)
    assert angle_between(quat_from_matrix(rows), quat) < 1e-7


@pytest.mark.parametrize("axis", [(1, 0, 0), (0, 1, 0), (0, 0, 1)])
def test_half_rotations_survive_the_matrix(axis: Vector) -> None:
    quat = quat_from_axis_angle(axis, math.pi)
    assert angle_between(quat_from_matrix(matrix_from_quat(quat)), quat) < 1e-12


@given(quaternions, vectors)
def test_rotating_a_vector_agrees_with_scipy(quat: Quaternion, xyz: Vector) -> None:
    assert rotate(quat, xyz) == pytest.approx(tuple(Rotation.from_quat(quat).apply(xyz)), abs=1e-9)


def test_the_optical_rotation_is_z_forward_x_right_y_down() -> None:
    assert quat_from_rpy(-math.pi / 2, 0, -math.pi / 2) == pytest.approx(OPTICAL_XYZW)
    assert rotate(OPTICAL_XYZW, (0, 0, 1)) == pytest.approx(
        (1, 0, 0)
    )  # optical z is the body's forward
    assert rotate(OPTICAL_XYZW, (1, 0, 0)) == pytest.approx(
        (0, -1, 0)
    )  # optical x is the body's right
    assert rotate(OPTICAL_XYZW, (0, 1, 0)) == pytest.approx(
        (0, 0, -1)
    )  # optical y is the body's down


def test_positive_pitch_points_down() -> None:
    forward = rotate(quat_from_rpy(0, math.radians(15), 0), (1, 0, 0))
    assert forward == pytest.approx((math.cos(math.radians(15)), 0, -math.sin(math.radians(15))))


@given(quaternions, quaternions)
def test_a_product_is_a_unit_quaternion(a: Quaternion, b: Quaternion) -> None:
    assert norm(multiply(a, b)) == pytest.approx(1, abs=1e-15)


def test_the_angle_between_a_rotation_and_itself_is_zero_whatever_its_sign() -> None:
    x, y, z, w = quat_from_rpy(0.1, 0.2, 0.3)
    assert angle_between((x, y, z, w), (-x, -y, -z, -w)) == pytest.approx(0, abs=1e-15)
    assert angle_between(IDENTITY_XYZW, OPTICAL_XYZW) == pytest.approx(math.radians(120))
