"""What the buffer costs: ``python -m tests.benchmarks.bench_buffer``, or name the file to pytest.

The measure for single lookups is the way a program would do it by hand, edge by edge with
``Pose``; that for trajectories is as many single lookups.
"""

from __future__ import annotations

import math
import os
import time
from timeit import repeat
from typing import TYPE_CHECKING

import numpy as np

from tests.benchmarks.results import record
from tfcompose.foundation.geometry import Pose, quat_from_rpy
from tfcompose.tf.ros.tf_codec import Decoder, SentTransform, encode
from tfcompose.tf.tf2 import Buffer

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.benchmarks.results import Rows

S = 1_000_000_000
START = 1_795_244_326 * S
HZ = 50
HISTORY_S = 10
STAMPS = 10_000


def chain(moving: int, fixed: int) -> tuple[Buffer, str]:
    """Return a buffer with 10 s at 50 Hz, and the last frame of a chain of ``edges`` below f0."""
    buffer = Buffer()
    for index in range(moving + fixed):
        parent, child = f"f{index}", f"f{index + 1}"
        if index >= moving:
            buffer.set(
                parent, child, Pose((0.1, 0.2, 0.3), quat_from_rpy(0.1, 0.2, 0.3)), 0, static=True
            )
            continue
        for step in range(HISTORY_S * HZ + 1):
            pose = Pose((0.01 * step, 0.2, 0.3), quat_from_rpy(0.1, 0.2, 0.02 * step + index))
            buffer.set(parent, child, pose, START + step * S // HZ, static=False)
    return buffer, f"f{moving + fixed}"


def best_us(call: Callable[[], object], number: int) -> float:
    """Return the microseconds of one call in the quickest of some rounds."""
    return min(repeat(call, number=number, repeat=7)) / number * 1e6


def single() -> dict[str, float]:
    """Return the microseconds of single lookups through 10 edges."""
    fixed, end = chain(0, 10)
    mixed, _ = chain(3, 7)
    moving, _ = chain(10, 0)
    between = START + 5 * S + 7
    poses = [Pose((0.1, 0.2, 0.3), quat_from_rpy(0.1, 0.2, 0.3))] * 10

    def by_hand() -> Pose:
        pose = Pose()
        for each in poses:
            pose = pose @ each
        return pose

    return {
        "10 fixed edges, by hand": best_us(by_hand, 1000),
        "10 fixed edges": best_us(lambda: fixed.lookup_transform("f0", end, 0), 5000),
        "3 moving edges of 10": best_us(lambda: mixed.lookup_transform("f0", end, between), 2000),
        "10 moving edges": best_us(lambda: moving.lookup_transform("f0", end, between), 1000),
    }


def many() -> dict[str, float]:
    """Return the milliseconds of 10,000 lookups through 3 moving and 7 fixed edges.

    At once, and one by one.
    """
    buffer, end = chain(3, 7)
    stamps = np.linspace(START, START + HISTORY_S * S, STAMPS).astype(np.int64)
    times = stamps.tolist()

    def one_by_one() -> None:
        for stamp in times:
            buffer.lookup_transform("f0", end, stamp)

    return {
        "lookup_many": best_us(lambda: buffer.lookup_many("f0", end, stamps), 3) / 1e3,
        "one by one": min(repeat(one_by_one, number=1, repeat=3)) * 1e3,
    }


def points() -> dict[str, float]:
    """Return the milliseconds of a million points."""
    buffer, end = chain(1, 2)
    cloud = np.random.default_rng(1).normal(size=(1_000_000, 3))
    given = {"float64": cloud, "float32": cloud.astype(np.float32)}
    return {
        name: best_us(lambda each=each: buffer.transform_points(each, "f0", end), 1) / 1e3  # type: ignore[misc]
        for name, each in given.items()
    }


def intake() -> float:
    """Return the share of a core that decoding and inserting 1,000 edges at 50 Hz takes.

    The edges come in messages of 100.
    """
    seconds, warm_s = 2, 10
    messages = [
        encode(
            [
                SentTransform(
                    START + step * S // HZ,
                    f"parent_of_link_{first + index}",
                    f"link_{first + index}",
                    (0.1 * step, 0.2, 0.3),
                    (0.0, 0.0, math.sin(0.01 * step), math.cos(0.01 * step)),
                )
                for index in range(100)
            ]
        )
        for step in range((warm_s + seconds) * HZ)
        for first in range(0, 1000, 100)
    ]
    buffer, decoder = Buffer(), Decoder()
    warm = warm_s * HZ * 10
    for data in messages[:warm]:
        buffer.insert(decoder.rows(data), static=False)
    begun = time.process_time()
    for data in messages[warm:]:
        buffer.insert(decoder.rows(data), static=False)
    return (time.process_time() - begun) / seconds


def test_a_lookup_through_ten_edges_costs_under_8_us_fixed_and_under_40_interpolated() -> None:
    found = single()
    assert found["10 fixed edges"] < 8, found
    assert found["10 fixed edges"] < found["10 fixed edges, by hand"] / 2, found
    assert found["3 moving edges of 10"] < 40, found
    assert found["10 moving edges"] < 3 * found["10 fixed edges, by hand"], found


def test_ten_thousand_lookups_at_once_are_50_times_faster_than_one_by_one() -> None:
    found = many()
    assert found["one by one"] > 50 * found["lookup_many"], found


def test_a_million_points_are_moved_in_under_60_ms() -> None:
    found = points()
    assert max(found.values()) < 60, found


def test_a_thousand_edges_at_50_hz_take_under_15_percent_of_a_core() -> None:
    assert intake() < 0.15


def rows() -> Rows:
    """Measure what the README prints, beside it the measure of the same run."""
    one, more = single(), many()
    at_once, singly = more["lookup_many"], more["one by one"]
    by_hand = f"{one['10 fixed edges, by hand']:.1f} µs by hand, with `Pose`"
    return {
        "`lookup_transform` through 10 fixed edges": [f"{one['10 fixed edges']:.1f} µs", by_hand],
        "… through 10 edges of which 3 are interpolated": [
            f"{one['3 moving edges of 10']:.1f} µs",
            "",
        ],
        "… through 10 edges, all interpolated": [f"{one['10 moving edges']:.1f} µs", ""],
        "`lookup_many`, 10,000 times through 3 moving and 7 fixed edges": [
            f"{at_once:.2f} ms",
            f"{singly:.0f} ms one by one: {singly / at_once:.0f} times as long",
        ],
        "`transform_points`, a million points": [f"{max(points().values()):.0f} ms", ""],
        "1,000 edges at 50 Hz decoded and taken": [f"{100 * intake():.0f} % of a core", ""],
    }


if __name__ == "__main__":
    before = os.getloadavg()[0]
    record("buffer", rows(), before)
