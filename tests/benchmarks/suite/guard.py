"""The guard of many moving edges, beside a plain rclpy node that decodes the same messages."""

from __future__ import annotations

from tests.benchmarks.benchmark import Benchmark, Limit, Row
from tests.benchmarks.contenders import RCLPY
from tests.benchmarks.fixed_robot import PROGRAMS
from tests.benchmarks.guarding import contenders
from tfcompose.foundation.geometry import Pose
from tfcompose.model.plan import Plan, PlanEdge, PlanProcess, RosSettings, SourceLine

EDGES, EDGES_A_MESSAGE, RATE = 1000, 100, 50


def plan() -> Plan:
    """Return the plan whose edges the owner sends."""
    edges = tuple(
        PlanEdge(
            "base",
            f"frame_{n}",
            "dynamic",
            "owner",
            "/owner",
            pose=Pose(),
            rate=RATE,
            source=SourceLine("bench.yaml", n),
        )
        for n in range(EDGES)
    )
    owns = tuple((edge.parent, edge.child) for edge in edges)
    processes = (
        PlanProcess("owner", "external", nodes=("/owner",), owns=owns),
        PlanProcess("guard", "guard", nodes=("/bench/guard",)),
    )
    return Plan("bench", "0", "base", RosSettings(), edges, processes)


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
    contenders=contenders(plan(), OWNER, seconds=4.0),
    runs=5,
)
