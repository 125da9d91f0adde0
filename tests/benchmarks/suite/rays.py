"""Building a robot with many cameras, whose fields of view are checked against all bodies."""

from __future__ import annotations

from tests.benchmarks.benchmark import Benchmark, Limit, Row
from tests.benchmarks.building import Robot, contenders
from tests.benchmarks.robots import GROUP

SMALL, LARGE = Robot("cameras", 1_000), Robot("cameras", 3_000)

BENCHMARK = Benchmark(
    name="rays",
    about="processor time of a whole process, user and system; xacro expands the same robot and"
    " checks nothing",
    rows={
        robot.row: Row(
            f"`build`: {robot.links:,} links, {robot.links // GROUP} cameras with fields of view",
            "s",
        )
        for robot in (SMALL, LARGE)
    }
    | {
        "growth": Row("… growth from 1,000 links", "times", (Limit(3.5, "least"),)),
        "memory": Row("… memory", "MB"),
    },
    contenders=contenders((SMALL, LARGE)),
    runs=5,
    quick_runs=1,
)
