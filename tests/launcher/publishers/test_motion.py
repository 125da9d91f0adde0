import math
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from tfcompose.launcher.publishers.simulate import JointSource, circle, swept
from tfcompose.model.plan import PlanJoint, Simulation, Sweep


@given(
    st.floats(0.1, 5), st.floats(-3, 3).filter(lambda speed: abs(speed) > 0.01), st.floats(0, 100)
)
def test_on_the_circle_a_body_faces_where_it_goes(
    radius: float, speed: float, time_s: float
) -> None:
    pose = circle(radius, speed, time_s)
    assert math.hypot(*pose.xyz) == pytest.approx(radius)
    heading = Rotation.from_quat(pose.quat_xyzw).apply([1, 0, 0])
    velocity = [-speed * pose.xyz[1], speed * pose.xyz[0], 0.0]
    assert list(heading) == pytest.approx([v / abs(speed) / radius for v in velocity], abs=1e-9)


def test_the_circle_starts_on_the_x_axis() -> None:
    assert circle(2.0, 0.5, 0.0).xyz == (2, 0, 0)


ranges = st.tuples(st.floats(-3, 3), st.floats(0.01, 3)).map(
    lambda pair: (pair[0], pair[0] + pair[1])
)


@given(ranges, st.floats(0, 1), st.floats(0.5, 20))
def test_a_sweep_reaches_both_ends_and_no_further_from_where_it_begins(
    ends: tuple[float, float], fraction: float, period_s: float
) -> None:
    lower, upper = ends
    start = lower + fraction * (upper - lower)
    sweep = Sweep(period_s, lower, upper)
    places = [swept(sweep, start, period_s * n / 1000) for n in range(1001)]
    assert places[0] == pytest.approx(start, abs=1e-6)
    assert places[-1] == pytest.approx(places[0], abs=1e-6)
    assert lower - 1e-9 <= min(places) < lower + 1e-4 * (upper - lower)
    assert upper - 1e-4 * (upper - lower) < max(places) <= upper + 1e-9
    steps = [abs(b - a) * 1000 / period_s for a, b in pairwise(places)]
    assert max(steps) <= math.pi * (upper - lower) / period_s + 1e-9


def test_a_joint_without_ends_rotates_round_and_round() -> None:
    places = [swept(Sweep(4.0), 1.0, seconds) for seconds in (0.0, 1.0, 2.0, 3.0, 4.0)]
    assert places == pytest.approx([1.0, 1.0 + math.pi / 2, 1.0 - math.pi, 1.0 - math.pi / 2, 1.0])


def test_a_sweep_between_two_places_that_are_one_stays() -> None:
    assert swept(Sweep(1.0, 0.2, 0.2), 0.0, 0.3) == 0.2


def test_mimics_follow_a_simulated_joint_through_a_chain_in_any_order() -> None:
    axis = (0.0, 0.0, 1.0)
    joints = [
        PlanJoint("a_last", "prismatic", axis, "m_mid", 2.0, 0.1),
        PlanJoint("m_mid", "revolute", axis, "z_first", -1.0, 0.5),
        PlanJoint("z_first", "continuous", axis),
        PlanJoint("other", "revolute", axis, "nobody", 1.0, 0.0),
        PlanJoint("free", "floating", axis, "z_first", 1.0, 0.0),
    ]
    simulation = Simulation(
        "joints", 50.0, joints={"z_first": 0.25, "lift": 1.0}, sweep={"lift": Sweep(4.0, 0.0, 2.0)}
    )
    source = JointSource(simulation, joints)
    assert source.names == ["z_first", "lift", "a_last", "m_mid"]
    assert source.positions(1.0) == pytest.approx([0.25, 2.0, 2 * (0.5 - 0.25) + 0.1, 0.5 - 0.25])
