"""Lookups, points and intake of the buffer, beside the same done by hand."""

from __future__ import annotations

import math
import time
from contextlib import contextmanager
from timeit import timeit
from typing import TYPE_CHECKING

from tests.benchmarks.benchmark import TFCOMPOSE, Benchmark, Contender, Limit, Row
from tfcompose.foundation.geometry import Pose, quat_from_rpy
from tfcompose.tf.ros.tf_codec import Decoder, SentTransform, encode
from tfcompose.tf.tf2 import Buffer

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from tests.benchmarks.benchmark import Sampler, Workspace

BY_HAND = Contender("`Pose`, edge by edge")
ONE_BY_ONE = Contender("`lookup_transform`, one by one")
S = 1_000_000_000
START_NS = 1_795_244_326 * S
RATE, HISTORY_S = 50, 10
STAMPS, POINTS = 10_000, 1_000_000
INTAKE_EDGES, INTAKE_S = 1_000, 2


def chain(moving: int, fixed: int) -> tuple[Buffer, str]:
    """Return a buffer with 10 s at 50 Hz, and the last frame of a chain of edges below f0."""
    buffer = Buffer()
    for index in range(moving + fixed):
        parent, child = f"f{index}", f"f{index + 1}"
        if index >= moving:
            pose = Pose((0.1, 0.2, 0.3), quat_from_rpy(0.1, 0.2, 0.3))
            buffer.set(parent, child, pose, 0, static=True)
            continue
        for step in range(HISTORY_S * RATE + 1):
            pose = Pose((0.01 * step, 0.2, 0.3), quat_from_rpy(0.1, 0.2, 0.02 * step + index))
            buffer.set(parent, child, pose, START_NS + step * S // RATE, static=False)
    return buffer, f"f{moving + fixed}"


def us(call: Callable[[], object], number: int) -> float:
    """Return the microseconds of one call, of this many in a row."""
    return timeit(call, number=number) / number * 1e6


@contextmanager
def tfcompose(workspace: Workspace) -> Iterator[Sampler]:
    """Look up, move points and take messages in."""
    import numpy as np  # noqa: PLC0415 (an extra, which only this contender needs)

    (fixed, end), (mixed, _), (moving, _) = chain(0, 10), chain(3, 7), chain(10, 0)
    between_ns = START_NS + 5 * S + 7
    stamps_ns = np.linspace(START_NS, START_NS + HISTORY_S * S, STAMPS).astype(np.int64)
    cloud = np.random.default_rng(1).normal(size=(POINTS, 3))
    near, near_end = chain(1, 2)
    count = 200 if workspace.is_quick else 2_000

    def sample() -> Mapping[str, float]:
        return {
            "fixed": us(lambda: fixed.lookup_transform("f0", end, 0), count),
            "mixed": us(lambda: mixed.lookup_transform("f0", end, between_ns), count),
            "moving": us(lambda: moving.lookup_transform("f0", end, between_ns), count),
            "many": us(lambda: mixed.lookup_many("f0", end, stamps_ns), 3) / 1e3,
            "points": us(lambda: near.transform_points(cloud, "f0", near_end), 1) / 1e3,
            "intake": intake(),
        }

    yield sample


@contextmanager
def by_hand(workspace: Workspace) -> Iterator[Sampler]:
    """Multiply the poses of ten edges, as a program without a buffer does."""
    poses = [Pose((0.1, 0.2, 0.3), quat_from_rpy(0.1, 0.2, 0.3))] * 10
    count = 200 if workspace.is_quick else 2_000

    def lookup() -> Pose:
        pose = Pose()
        for each in poses:
            pose = pose @ each
        return pose

    yield lambda: {"fixed": us(lookup, count)}


@contextmanager
def one_by_one(_: Workspace) -> Iterator[Sampler]:
    """Look up each stamp by itself."""
    buffer, end = chain(3, 7)
    stamps_ns = [START_NS + n * HISTORY_S * S // STAMPS for n in range(STAMPS)]

    def lookup() -> None:
        for stamp_ns in stamps_ns:
            buffer.lookup_transform("f0", end, stamp_ns)

    yield lambda: {"many": us(lookup, 1) / 1e3}


def intake() -> float:
    """Return the share of a core, in percent, that decoding and inserting edges takes.

    There are 1,000 at 50 Hz, in messages of 100, and a buffer that has its history already.
    """
    messages = [
        encode(
            [
                SentTransform(
                    START_NS + step * S // RATE,
                    f"parent_of_link_{first + index}",
                    f"link_{first + index}",
                    (0.1 * step, 0.2, 0.3),
                    (0.0, 0.0, math.sin(0.01 * step), math.cos(0.01 * step)),
                )
                for index in range(100)
            ]
        )
        for step in range((HISTORY_S + INTAKE_S) * RATE)
        for first in range(0, INTAKE_EDGES, 100)
    ]
    buffer, decoder = Buffer(), Decoder()
    warm = HISTORY_S * RATE * INTAKE_EDGES // 100
    for data in messages[:warm]:
        buffer.insert(decoder.rows(data), static=False)
    began = time.process_time()
    for data in messages[warm:]:
        buffer.insert(decoder.rows(data), static=False)
    return 100 * (time.process_time() - began) / INTAKE_S


BENCHMARK = Benchmark(
    name="buffer",
    about="one process, without ROS",
    rows={
        "fixed": Row(
            "`lookup_transform` through 10 fixed edges",
            "µs",
            (Limit(0.5, "least", times=BY_HAND),),
        ),
        "mixed": Row("… through 10 edges, 3 of them interpolated", "µs"),
        "moving": Row("… through 10 edges, all interpolated", "µs"),
        "many": Row(
            "`lookup_many`, 10,000 times through 3 moving and 7 fixed edges",
            "ms",
            (Limit(0.02, "least", times=ONE_BY_ONE),),
        ),
        "points": Row("`transform_points`, a million points", "ms", (Limit(60.0, "least"),)),
        "intake": Row(
            "1,000 edges at 50 Hz decoded and taken in", "% of a core", (Limit(15.0, "least"),)
        ),
    },
    contenders={TFCOMPOSE: tfcompose, BY_HAND: by_hand, ONE_BY_ONE: one_by_one},
    runs=5,
)
