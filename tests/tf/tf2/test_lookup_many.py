"""Whole trajectories at once."""

import math
from typing import Any

import numpy as np
import pytest

from tfcompose.foundation.geometry import Pose, quat_from_rpy
from tfcompose.tf.tf2 import (
    Buffer,
    ConnectivityException,
    ExtrapolationException,
    InvalidArgumentException,
)

S = 1_000_000_000


def drive(rotation: float = 0.1) -> Buffer:
    """A base that drives 1 m and turns ``rotation`` rad/s for 9 s, with a laser on it."""
    buffer = Buffer()
    for step in range(91):
        pose = Pose((step / 10, 0, 0), quat_from_rpy(0, 0, rotation * step / 10))
        buffer.set("odom", "base", pose, 100 * S + step * S // 10, static=False)
    buffer.set("base", "laser", Pose((0, 0, 0.3)), 0, static=True)
    return buffer


@pytest.mark.parametrize(
    "rotation", [0.1, 25.0], ids=["small angles between samples", "large ones"]
)
@pytest.mark.parametrize("order", ["ascending", "shuffled"])
def test_the_rows_are_the_lookups_in_the_order_of_the_times(rotation: float, order: str) -> None:
    buffer = drive(rotation)
    stamps = np.linspace(100 * S, 109 * S, 40_001).astype(np.int64)  # more than one block
    if order == "shuffled":
        np.random.default_rng(1).shuffle(stamps)
    for target, source in (("odom", "laser"), ("laser", "odom")):
        xyz, quat_xyzw = buffer.lookup_many(target, source, stamps)
        for row in (*range(0, 40_001, 1777), 40_000):
            pose, _ = buffer.lookup(target, source, int(stamps[row]))
            assert xyz[row] == pytest.approx(pose.xyz, abs=1e-12)
            assert quat_xyzw[row] == pytest.approx(pose.quat_xyzw, abs=1e-12)


def test_matrices_take_points_of_the_source_to_the_target() -> None:
    buffer = drive()
    matrix = buffer.lookup_many("odom", "laser", [105 * S]).matrices()[0]
    moved = matrix @ [2.0, 0.0, 0.0, 1.0]
    assert moved == pytest.approx([5 + 2 * math.cos(0.5), 2 * math.sin(0.5), 0.3, 1.0])
    assert matrix[3].tolist() == [0, 0, 0, 1]


def test_zero_is_the_newest_common_time() -> None:
    xyz, _ = drive().lookup_many("odom", "base", [0, 100 * S])
    assert xyz[:, 0].tolist() == [9.0, 0.0]


def test_times_that_an_edge_does_not_know_raise_or_are_rows_of_nan() -> None:
    buffer = drive()
    stamps = [100 * S, 99 * S, 110 * S, 109 * S]
    with pytest.raises(ExtrapolationException, match=r"odom → base at 99.* 1000 ms .* 2 of 4 "):
        buffer.lookup_many("odom", "laser", stamps)
    trajectory = buffer.lookup_many("odom", "laser", stamps, outside="nan")
    assert np.isnan(trajectory.xyz[:, 0]).tolist() == [False, True, True, False]
    assert np.isnan(trajectory.quat_xyzw).any(axis=1).tolist() == [False, True, True, False]
    assert trajectory.xyz[3].tolist() == [9.0, 0.0, 0.3]


def test_an_edge_with_one_sample_is_known_at_its_time() -> None:
    buffer = Buffer()
    buffer.set("a", "b", Pose((1, 2, 3)), 5 * S, static=False)
    trajectory = buffer.lookup_many("a", "b", [4 * S, 5 * S, 6 * S], outside="nan")
    assert np.isnan(trajectory.xyz[:, 0]).tolist() == [True, False, True]
    assert trajectory.xyz[1].tolist() == [1, 2, 3]


def test_two_samples_of_one_time_count_as_in_a_single_lookup() -> None:
    buffer = Buffer()
    for x, second in ((1, 1), (2, 1), (5, 2), (6, 2), (7, 3), (8, 3)):
        buffer.set("a", "b", Pose((x, 0, 0)), second * S, static=False)
    stamps = [S, S + 1, 3 * S // 2, 2 * S - 1, 2 * S, 2 * S + 1, 5 * S // 2, 3 * S]
    expected = [buffer.lookup("a", "b", stamp)[0].xyz[0] for stamp in stamps]
    assert buffer.lookup_many("a", "b", stamps).xyz[:, 0] == pytest.approx(expected, abs=1e-12)
    only = Buffer()
    for x in (1, 2):
        only.set("a", "b", Pose((x, 0, 0)), S, static=False)
    assert only.lookup_many("a", "b", [S]).xyz[0, 0] == only.lookup("a", "b", S)[0].xyz[0] == 2


def test_a_frame_that_changed_its_parent_is_followed() -> None:
    buffer = Buffer()
    for parent, x, second in (("table", 1, 1), ("table", 2, 2), ("hand", 5, 3), ("hand", 6, 4)):
        buffer.set(parent, "cup", Pose((x, 0, 0)), second * S, static=False)
    buffer.set("world", "table", Pose((10, 0, 0)), 0, static=True)
    buffer.set("world", "hand", Pose((20, 0, 0)), 0, static=True)
    stamps = [S, 3 * S // 2, 5 * S // 2, 3 * S, 7 * S // 2, 5 * S]
    trajectory = buffer.lookup_many("world", "cup", stamps, outside="nan")
    assert trajectory.xyz[:5, 0].tolist() == [11.0, 11.5, 12.0, 25.0, 25.5]
    assert np.isnan(trajectory.xyz[5]).all()


def test_fixed_edges_and_a_frame_in_itself_fill_all_rows() -> None:
    buffer = drive()
    assert buffer.lookup_many("base", "laser", [1, 2, 3]).xyz.tolist() == [[0, 0, 0.3]] * 3
    assert buffer.lookup_many("base", "base", [1, 2]).quat_xyzw.tolist() == [[0, 0, 0, 1]] * 2
    assert buffer.lookup_many("odom", "base", []).xyz.shape == (0, 3)


@pytest.mark.parametrize("stamps", [[1.5], [[1, 2]], 5, ["now"]])
def test_times_that_are_no_row_of_integers_are_refused(stamps: Any) -> None:
    with pytest.raises(TypeError, match="nanoseconds"):
        drive().lookup_many("odom", "base", stamps)


def test_names_are_judged_as_in_a_single_lookup() -> None:
    buffer = drive()
    buffer.set("world", "table", Pose(), 0, static=True)
    with pytest.raises(ConnectivityException):
        buffer.lookup_many("odom", "table", [100 * S])
    with pytest.raises(InvalidArgumentException):
        buffer.lookup_many("/odom", "base", [100 * S])
