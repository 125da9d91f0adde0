"""Building a robot of many links, beside xacro that expands the same robot."""

from __future__ import annotations

from tests.benchmarks.benchmark import Benchmark, Limit, Row
from tests.benchmarks.building import Robot, contenders
from tests.benchmarks.contenders import XACRO

PLAIN, JOINTED = Robot("plain", 1_000), Robot("jointed", 1_000)

BENCHMARK = Benchmark(
    name="build",
    about="processor time of a whole process, user and system; xacro expands the same robot",
    rows={
        PLAIN.row: Row(
            "`build`: 1,000 links, boxes with a mass on fixed joints",
            "s",
            (Limit(1.25, "least", times=XACRO),),
        ),
        JOINTED.row: Row(
            "`build`: 1,000 links, inertia that is computed, on moving joints",
            "s",
            (Limit(1.25, "least", times=XACRO),),
        ),
    },
    contenders=contenders((PLAIN, JOINTED)),
    runs=9,
)
