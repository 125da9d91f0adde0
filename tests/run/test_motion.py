from __future__ import annotations

import math
from typing import TYPE_CHECKING

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from tfcompose.plan import Joint
from tfcompose.pose import Pose, angle_between, normalised
from tfcompose.run.motion import Joints, circle, joint_motion, read_positions

if TYPE_CHECKING:
    from collections.abc import Callable

    from tfcompose.plan import PlanEdge

    Edge = Callable[..., PlanEdge]

Z = (0.0, 0.0, 1.0)
turns = st.floats(-10, 10)


@given(st.tuples(turns, turns, turns).filter(lambda axis: math.hypot(*axis) > 0.1), turns)
def test_a_revolute_joint_turns_about_its_axis(axis: tuple[float, float, float], q: float) -> None:
    x, y, z, _ = normalised((*axis, 0.0))
    found = joint_motion(Joint("j", "revolute", (x, y, z)), q)
    expected = Rotation.from_rotvec([x * q, y * q, z * q]).as_quat()
    assert found.xyz == (0, 0, 0)
    assert angle_between(found.quat_xyzw, tuple(expected)) < 1e-7


def test_a_prismatic_joint_slides_along_its_axis() -> None:
    assert joint_motion(Joint("j", "prismatic", (0.0, 0.6, 0.8)), 2.0) == Pose((0.0, 1.2, 1.6))


@given(st.floats(0.1, 5), st.floats(-3, 3).filter(lambda speed: abs(speed) > 0.01), st.floats(0, 100))
def test_on_the_circle_a_body_looks_where_it_goes(radius: float, speed: float, time_s: float) -> None:
    pose = circle(radius, speed, time_s)
    assert math.hypot(*pose.xyz) == pytest.approx(radius)
    heading = Rotation.from_quat(pose.quat_xyzw).apply([1, 0, 0])
    velocity = [-speed * pose.xyz[1], speed * pose.xyz[0], 0.0]
    assert list(heading) == pytest.approx([v / abs(speed) / radius for v in velocity], abs=1e-9)


def test_the_circle_starts_on_the_x_axis() -> None:
    assert circle(2.0, 0.5, 0.0).xyz == (2, 0, 0)


def _mimic(edge: Edge, name: str, master: str, multiplier: float, offset: float) -> PlanEdge:
    joint = Joint(name, "prismatic", Z, master, multiplier, offset)
    return edge(f"base {name}", "joints", None, joint)


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 1, 0), (1, 2, 0)])
def test_a_chain_of_mimics_is_followed_in_any_order(edge: Edge, order: tuple[int, ...]) -> None:
    edges = [
        _mimic(edge, "z_middle", "master", 2.0, 1.0),
        _mimic(edge, "a_last", "z_middle", -3.0, 0.5),
        edge("base master", "joints", None, Joint("master", "prismatic", Z)),
    ]
    poses = Joints([edges[index] for index in order]).poses({"master": 10.0})
    assert [poses[order.index(i)].xyz[2] for i in range(3)] == [21.0, -62.5, 10.0]


def test_a_position_that_is_sent_for_a_mimic_wins(edge: Edge) -> None:
    edges = [_mimic(edge, "mimic", "master", 2.0, 0.0), _mimic(edge, "next", "mimic", 1.0, 1.0)]
    poses = Joints(edges).poses({"master": 10.0, "mimic": 3.0})
    assert [poses[0].xyz[2], poses[1].xyz[2]] == [3.0, 4.0]


def test_mimics_of_each_other_have_no_position(edge: Edge) -> None:
    edges = [_mimic(edge, "a", "b", 1.0, 0.0), _mimic(edge, "b", "a", 1.0, 0.0), _mimic(edge, "c", "a", 1.0, 0.0)]
    assert Joints(edges).poses({"other": 1.0}) == {}


def test_only_joints_that_a_message_speaks_of_move(edge: Edge) -> None:
    joints = Joints([edge(f"base {n}", "joints", None, Joint(n, "prismatic", Z)) for n in ("left", "right")])
    assert list(joints.poses({"left": 1.0})) == [0]
    assert list(joints.poses({"right": 1.0})) == [1]


def test_the_motion_follows_the_pose_of_the_edge(edge: Edge) -> None:
    quarter = Pose((1.0, 0.0, 0.0), normalised((0.0, 0.0, 1.0, 1.0)))
    joints = Joints([edge("base slide", "joints", quarter, Joint("slide", "prismatic", (1.0, 0.0, 0.0)))])
    assert joints.poses({"slide": 2.0})[0].xyz == pytest.approx((1.0, 2.0, 0.0))


WANTED = frozenset({"left", "right"})


def test_positions_are_read_by_name_and_others_are_left_out() -> None:
    assert read_positions(["grip", "left"], [math.nan, 2.0], WANTED) == {"left": 2.0}


@pytest.mark.parametrize(
    ("positions", "why"),
    [([], "no positions"), ([1.0], "another number"), ([1.0, 2.0, 3.0], "another number"), ([1.0, math.inf], "right")],
)
def test_a_message_that_cannot_be_believed_is_refused(positions: list[float], why: str) -> None:
    with pytest.raises(ValueError, match=why):
        read_positions(["left", "right"], positions, WANTED)
