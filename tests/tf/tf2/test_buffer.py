"""The buffer answers as tf2 does; scipy is the oracle for poses."""

import math
import random

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from tfcompose.foundation.geometry import (
    OPTICAL_XYZW,
    Pose,
    Quaternion,
    angle_between,
    quat_from_rpy,
)
from tfcompose.tf.tf2 import (
    Buffer,
    ConnectivityException,
    ExtrapolationException,
    InvalidArgumentException,
    LookupException,
)
from tfcompose.tf.tf2.pose_buffer import CACHE_NS
from tfcompose.tf.tf2.poses import IDENTITY, between, unit

S = 1_000_000_000


def pose_at(x: float, yaw: float = 0.0) -> Pose:
    return Pose((x, 0.0, 0.0), quat_from_rpy(0, 0, yaw))


def rover() -> Buffer:
    buffer = Buffer()
    buffer.set("odom", "base_link", pose_at(1.0, math.pi / 2), 5 * S, static=False)
    buffer.set("base_link", "laser", pose_at(0.3), 0, static=True)
    buffer.set("base_link", "camera", Pose((0.2, 0.0, 0.1), OPTICAL_XYZW), 0, static=True)
    return buffer


def test_the_pose_of_b_in_a_goes_up_one_branch_and_down_the_other() -> None:
    pose, stamp = rover().latest("laser", "camera")
    assert pose.xyz == pytest.approx((-0.1, 0, 0.1))
    assert angle_between(pose.quat_xyzw, OPTICAL_XYZW) < 1e-12
    assert stamp is None, "only fixed edges are between them"


def test_a_moving_edge_gives_the_pose_its_time() -> None:
    pose, stamp = rover().latest("odom", "laser")
    assert pose.xyz == pytest.approx((1.0, 0.3, 0.0))
    assert stamp == 5 * S


def test_the_edge_that_is_behind_is_named() -> None:
    buffer = rover()
    buffer.set("map", "odom", pose_at(0), 4 * S, static=False)
    assert buffer.behind("map", "laser") == "map → odom"
    assert buffer.behind("odom", "laser") == "odom → base_link"
    assert buffer.behind("laser", "camera") is None


def test_a_leading_slash_is_dropped_as_tf2_does() -> None:
    buffer = rover()
    buffer.set("/base_link", "/imu", pose_at(0.5), 0, static=True)
    assert buffer.latest("base_link", "imu")[0] == pose_at(0.5)
    with pytest.raises(InvalidArgumentException, match=r'"/base_link" .*base_link'):
        buffer.latest("/base_link", "imu")


def test_random_trees_agree_with_scipy() -> None:
    rng = random.Random(7)
    for _ in range(20):
        buffer, in_world = Buffer(), {"f0": (np.zeros(3), Rotation.identity())}
        for index in range(1, 15):
            parent = rng.choice(sorted(in_world))
            xyz = (rng.uniform(-3, 3), rng.uniform(-3, 3), rng.uniform(-3, 3))
            quat: Quaternion = quat_from_rpy(
                rng.uniform(-3, 3), rng.uniform(-1.5, 1.5), rng.uniform(-3, 3)
            )
            buffer.set(parent, f"f{index}", Pose(xyz, quat), 0, static=True)
            origin, rotation = in_world[parent]
            in_world[f"f{index}"] = (
                origin + rotation.apply(xyz),
                rotation * Rotation.from_quat(quat),
            )
        a, b = rng.sample(sorted(in_world), 2)
        pose, _ = buffer.latest(a, b)
        (pa, ra), (pb, rb) = in_world[a], in_world[b]
        assert pose.xyz == pytest.approx(tuple(ra.inv().apply(pb - pa)), abs=1e-9)
        assert angle_between(pose.quat_xyzw, tuple((ra.inv() * rb).as_quat())) < 1e-9


def test_the_newest_common_time_is_that_of_the_edge_that_is_behind() -> None:
    buffer = Buffer()
    for second in range(4):
        buffer.set("map", "odom", pose_at(0.1 * second), second * S, static=False)
        buffer.set("odom", "base", pose_at(float(second)), second * S + S // 2, static=False)
    pose, stamp = buffer.latest("map", "base")
    assert stamp == 3 * S
    assert pose.xyz[0] == pytest.approx(0.3 + 2.5), (
        "odom → base is taken half way between its samples"
    )


def test_rotations_are_interpolated_as_scipy_does() -> None:
    a, b = quat_from_rpy(0.1, 0.2, 0.3), quat_from_rpy(-1.0, 0.5, 2.5)
    slerp = Slerp([0, 1], Rotation.from_quat([a, b]))
    for part in (0.0, 0.25, 0.5, 0.9, 1.0):
        expected: Quaternion = tuple(slerp(part).as_quat())
        row = between((0, 0, 0, *a, 0, 0, 0, *b), part)
        assert angle_between((row[3], row[4], row[5], row[6]), expected) < 1e-12


def test_interpolation_takes_the_short_way_whatever_the_signs() -> None:
    x, y, z, w = quat_from_rpy(0, 0, 0.2)
    middle = unit(between((*IDENTITY, 0, 0, 0, -x, -y, -z, -w), 0.5))
    assert middle[3:] == pytest.approx(quat_from_rpy(0, 0, 0.1), abs=1e-12)


def test_an_unknown_frame_is_named_with_the_nearest_known() -> None:
    with pytest.raises(LookupException, match=r"lasr\b.*\blaser\?"):
        rover().latest("odom", "lasr")


def test_two_trees_are_reported_with_their_roots() -> None:
    buffer = rover()
    buffer.set("world", "table", pose_at(1), 0, static=True)
    with pytest.raises(ConnectivityException, match=r"odom\b.*\btable\b.*\bodom\b.*\bworld"):
        buffer.latest("odom", "table")


def test_edges_without_a_common_time_say_which_and_by_how_much() -> None:
    buffer = Buffer()
    buffer.set("map", "odom", pose_at(0), 1 * S, static=False)
    buffer.set("odom", "base", pose_at(0), 3 * S, static=False)
    with pytest.raises(ExtrapolationException, match=r"odom → base .*2000 ms .*map → odom"):
        buffer.latest("map", "base")


def test_a_history_is_ten_seconds_long() -> None:
    buffer = Buffer()
    for second in range(30):
        buffer.set("odom", "base", pose_at(float(second)), second * S, static=False)
    assert not buffer.set("odom", "base", pose_at(0), 29 * S - CACHE_NS - 1, static=False)
    buffer.set("map", "odom", pose_at(0), 20 * S, static=False)
    assert buffer.latest("map", "base")[0].xyz[0] == pytest.approx(20.0)
    early = Buffer()
    early.set("map", "odom", pose_at(0), 10 * S, static=False)
    for second in range(30):
        early.set("odom", "base", pose_at(float(second)), second * S, static=False)
    with pytest.raises(ExtrapolationException):
        early.latest("map", "base")
