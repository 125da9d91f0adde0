"""The published tree as a picture: each edge with its publisher, second parents too, and what has no pose."""

from __future__ import annotations

import pytest

from tfcompose.cli.live_graph import graph_of_census
from tfcompose.observe.census import Census, Publisher

SECOND = 1_000_000_000


def row(parent: str, child: str, second: int, x: float = 0.0, w: float = 1.0) -> tuple[object, ...]:
    return (parent, child, second, 0, x, 0.0, 0.0, 0.0, 0.0, 0.0, w)


@pytest.fixture
def census() -> Census:
    seen = Census()
    seen.graph([Publisher(b"1", "/drive", static=False), Publisher(b"2", "/static", static=True)])
    for second in range(1, 5):
        seen.take([row("odom", "base", second)], static=False, gid=b"1", received_ns=second * SECOND)  # type: ignore[list-item]
    seen.take([row("base", "lidar", 1, 0.25)], static=True, gid=b"2", received_ns=4 * SECOND)  # type: ignore[list-item]
    seen.take([row("mast", "lidar", 1, 0.5, 0.0)], static=True, gid=b"3", received_ns=4 * SECOND)  # type: ignore[list-item]
    return seen


def test_each_edge_has_its_publisher_its_kind_and_its_rate(census: Census) -> None:
    arrows = {(one.parent, one.child): one for one in graph_of_census(census, "/tf").arrows}
    assert len(arrows) == 3
    moving, fixed, second = arrows["odom", "base"], arrows["base", "lidar"], arrows["mast", "lidar"]
    assert (moving.owner, moving.kind, moving.beside, moving.below) == ("/drive", "dynamic", "1.0 Hz", "")
    assert (fixed.owner, fixed.kind, fixed.beside) == ("/static", "static", "")
    assert second.owner == "somebody"


def test_poses_stand_below_and_a_rotation_that_is_none_is_said(census: Census) -> None:
    arrows = {(one.parent, one.child): one for one in graph_of_census(census, "/tf", poses=True).arrows}
    assert arrows["base", "lidar"].below == "xyz 0.25 0 0"
    assert arrows["mast", "lidar"].below == "no rotation"
