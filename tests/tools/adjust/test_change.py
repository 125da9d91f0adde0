"""Changes of a pose as people type them; the oracle of rotations is scipy."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from tfcompose.foundation.geometry import Pose, quat_from_rpy
from tfcompose.tools.adjust.change import AXES, ChangeError, PoseChange, change_of, change_pose

ANGLES = st.floats(-3.0, 3.0)
POSES = st.builds(
    lambda xyz, rpy: Pose(xyz, quat_from_rpy(*rpy)),
    st.tuples(*[st.floats(-2, 2)] * 3),
    st.tuples(ANGLES, ANGLES, ANGLES),
)


@pytest.mark.parametrize(
    ("axis", "text", "change"),
    [
        ("x", "+2mm", PoseChange("x", 0.002)),
        ("y", "-0.5 cm", PoseChange("y", -0.005)),
        ("z", "=0.3m", PoseChange("z", 0.3, relative=False)),
        ("z", "=-30cm", PoseChange("z", -0.3, relative=False)),
        ("yaw", "-0.5deg", PoseChange("yaw", math.radians(-0.5))),
        ("yaw", "−0.5deg", PoseChange("yaw", math.radians(-0.5))),
        ("pitch", "=0", PoseChange("pitch", 0.0, relative=False)),
    ],
)
def test_a_sign_adds_and_an_equals_sign_replaces(axis: str, text: str, change: PoseChange) -> None:
    assert change_of(axis, text) == change


@pytest.mark.parametrize(
    ("axis", "text"),
    [
        *[("x", text) for text in ("2mm", "", "+2", "+2deg", "+2 furlong", "++2mm", "+nanm", "=")],
        *[("x", text) for text in ("+1e400 m", "+1e308m", "=-1e31 m", "+1e306 km")],
        *[("yaw", text) for text in ("+1mm", "=1", "0.5deg", "+1e31 rad")],
    ],
)
def test_a_text_that_may_mean_something_else_is_refused(axis: str, text: str) -> None:
    with pytest.raises(ChangeError, match=f"--{axis} ") as error:
        change_of(axis, text)
    assert not str(error.value).endswith("; ")


@pytest.mark.parametrize("local", [False, True])
def test_a_position_that_no_file_could_have_is_refused(local: bool) -> None:  # noqa: FBT001
    change = change_of("x", "+0.9e30 m")
    moved = change_pose(Pose(), [change], local=local)
    with pytest.raises(ChangeError):
        change_pose(moved, [change], local=local)


def changes_of(values: tuple[float, ...], *, relative: bool) -> list[PoseChange]:
    return [
        PoseChange(axis, value, relative=relative)
        for axis, value in zip(AXES, values, strict=True)
    ]


SIX = st.tuples(*[st.floats(-1, 1)] * 3, *[ANGLES] * 3)


def agree(pose: Pose, xyz: np.ndarray, rotation: Rotation) -> None:
    assert np.allclose(pose.xyz, xyz, atol=1e-9)
    difference = Rotation.from_quat(pose.quat_xyzw).inv() * rotation
    assert difference.magnitude() == pytest.approx(0, abs=1e-7)


@given(POSES, SIX)
def test_additions_go_along_and_about_the_axes_of_the_parent(
    pose: Pose, values: tuple[float, ...]
) -> None:
    moved = change_pose(pose, changes_of(values, relative=True), local=False)
    rotation = Rotation.from_euler("xyz", values[3:]) * Rotation.from_quat(pose.quat_xyzw)
    agree(moved, np.add(pose.xyz, values[:3]), rotation)


@given(POSES, SIX)
def test_local_additions_go_along_and_about_the_axes_of_the_mount(
    pose: Pose, values: tuple[float, ...]
) -> None:
    moved = change_pose(pose, changes_of(values, relative=True), local=True)
    before = Rotation.from_quat(pose.quat_xyzw)
    xyz = np.add(pose.xyz, before.apply(values[:3]))
    agree(moved, xyz, before * Rotation.from_euler("xyz", values[3:]))


@given(POSES, SIX)
def test_replacements_are_the_values_of_the_robot_file(
    pose: Pose, values: tuple[float, ...]
) -> None:
    moved = change_pose(pose, changes_of(values, relative=False), local=False)
    agree(moved, np.array(values[:3]), Rotation.from_euler("xyz", values[3:]))


def test_a_value_that_is_replaced_leaves_the_others_to_the_last_bit() -> None:
    pose = Pose((0.1, 0.2, 0.3), quat_from_rpy(0.1, math.pi / 2, 0.3))
    moved = change_pose(pose, [PoseChange("z", 1.0, relative=False)], local=False)
    assert moved == Pose((0.1, 0.2, 1.0), pose.quat_xyzw)


def test_a_value_is_replaced_before_another_is_added() -> None:
    changes = [
        PoseChange("yaw", 0.1),
        PoseChange("yaw", 1.0, relative=False),
        PoseChange("x", 0.5),
    ]
    moved = change_pose(Pose(), changes, local=True)
    assert moved.rpy[2] == pytest.approx(1.1)
    assert moved.xyz == pytest.approx((0.5 * math.cos(1), 0.5 * math.sin(1), 0))
