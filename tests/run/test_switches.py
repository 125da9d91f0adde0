"""Switches that were read back from nodes, against what the plan wrote."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from tfcompose.plan import Driven
from tfcompose.run.guard.switches import not_taken

if TYPE_CHECKING:
    from tfcompose.ros.parameters import Value

DRIVEN = (Driven("front", "realsense/d455", publishes=False, switch={"publish_tf": False}),)


@pytest.mark.parametrize(
    ("wanted", "found", "told"),
    [
        (False, False, False),
        (False, True, True),
        (True, True, False),
        (0.0, 0.0, False),
        (0.0, 0, False),
        (0.0, 0.05, True),
        (1, True, True),
        (False, 0, True),
        ("link", "link", False),
        ("link", "frame", True),
        (False, None, True),
    ],
)
def test_a_parameter_is_told_exactly_where_it_is_another_value(
    wanted: Value, found: Value | None, *, told: bool
) -> None:
    wrong = not_taken("/front/front", {"switch": wanted}, {"switch": found}, DRIVEN)
    assert [one.code for one in wrong] == ["TF829"] * told


def test_the_finding_names_the_node_the_parameter_and_both_values() -> None:
    (one,) = not_taken("/front/front", {"publish_tf": False}, {"publish_tf": True}, DRIVEN)
    assert one.message == (
        "/front/front has publish_tf: true, and the plan wrote publish_tf: false for front (realsense/d455)"
    )
    (one,) = not_taken("/drive", {"enable_odom_tf": False}, {"enable_odom_tf": None})
    assert one.message == "/drive has no parameter enable_odom_tf, and the plan wrote enable_odom_tf: false"
