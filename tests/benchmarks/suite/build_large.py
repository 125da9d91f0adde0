"""Building a robot of ten thousand links, beside xacro, whose time grows with the square."""

from __future__ import annotations

from tests.benchmarks.benchmark import Benchmark, Limit, Row
from tests.benchmarks.building import Robot, contenders
from tests.benchmarks.contenders import XACRO

SMALL, LARGE = Robot("plain", 1_000), Robot("plain", 10_000)

BENCHMARK = Benchmark(
    name="build_large",
    about="processor time of a whole process, user and system; xacro expands the same robot",
    rows={
        LARGE.row: Row(
            "`build`: 10,000 links, boxes with a mass on fixed joints",
            "s",
            (Limit(0.25, "least", times=XACRO),),
        ),
        SMALL.row: Row("… 1,000 links, in the same run", "s"),
        "growth": Row("… growth from 1,000 links", "times", (Limit(12.0, "least"),)),
        "memory": Row("… memory", "MB", (Limit(1_000.0),)),
    },
    contenders=contenders((SMALL, LARGE)),
    runs=2,
    quick_runs=1,
)
