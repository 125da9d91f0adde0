"""Building a robot of many links, beside xacro that expands the same robot."""

from __future__ import annotations

from tests.benchmarks.benchmark import Benchmark, Limit, Row
from tests.benchmarks.building import Robot, contenders
from tests.benchmarks.contenders import XACRO

PLAIN, JOINTED, LARGE = Robot("plain", 1_000), Robot("jointed", 1_000), Robot("plain", 10_000)

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
        LARGE.row: Row(
            "`build`: 10,000 links, boxes with a mass on fixed joints",
            "s",
            (Limit(0.25, "least", times=XACRO),),
        ),
        "growth": Row("… growth from 1,000 links", "times", (Limit(12.0, "least"),)),
        "memory": Row("… memory", "MB", (Limit(1_000.0),)),
    },
    contenders=contenders((PLAIN, JOINTED, LARGE)),
    runs=3,
    quick_runs=1,
)
