"""The guard of many moving edges, beside a plain rclpy node that decodes the same messages."""

from __future__ import annotations

from tests.benchmarks.benchmark import Benchmark, Limit, Row
from tests.benchmarks.contenders import RCLPY
from tests.benchmarks.fixed_robot import PROGRAMS
from tests.benchmarks.guarding import contenders, plan_of

EDGES, EDGES_A_MESSAGE, RATE = 1000, 100, 50
OWNED = {"owner": [f"frame_{n}" for n in range(EDGES)]}
OWNER = (PROGRAMS / "owner.py", "base", str(EDGES), str(RATE), str(EDGES_A_MESSAGE))
BENCHMARK = Benchmark(
    name="guard",
    about="an owner sends edges in messages of 100; plain rclpy decodes them and does no more",
    rows={
        "core": Row(
            f"the guard, with {EDGES:,} edges at {RATE} Hz",
            "% of a core",
            (Limit(1.0, "least", times=RCLPY),),
        ),
        "findings": Row("… false findings in 4 s", "findings", (Limit(0),)),
    },
    contenders=contenders(plan_of(OWNED, RATE), OWNER, seconds=4.0),
    runs=5,
)
