from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from tfcompose.run.motion import circle


@given(st.floats(0.1, 5), st.floats(-3, 3).filter(lambda speed: abs(speed) > 0.01), st.floats(0, 100))
def test_on_the_circle_a_body_looks_where_it_goes(radius: float, speed: float, time_s: float) -> None:
    pose = circle(radius, speed, time_s)
    assert math.hypot(*pose.xyz) == pytest.approx(radius)
    heading = Rotation.from_quat(pose.quat_xyzw).apply([1, 0, 0])
    velocity = [-speed * pose.xyz[1], speed * pose.xyz[0], 0.0]
    assert list(heading) == pytest.approx([v / abs(speed) / radius for v in velocity], abs=1e-9)


def test_the_circle_starts_on_the_x_axis() -> None:
    assert circle(2.0, 0.5, 0.0).xyz == (2, 0, 0)
