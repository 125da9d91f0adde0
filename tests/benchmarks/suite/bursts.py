"""The guard of many nodes that publish at the same moment."""

from __future__ import annotations

from tests.benchmarks.benchmark import Benchmark, Limit, Row
from tests.benchmarks.fixed_robot import PROGRAMS
from tests.benchmarks.guarding import contenders
from tfcompose.foundation.geometry import Pose
from tfcompose.model.plan import Plan, PlanEdge, PlanProcess, RosSettings, SourceLine

NODES, EDGES, RATE = 100, 10, 10


def plan() -> Plan:
    """Return the plan whose edges the nodes send."""
    edges = tuple(
        PlanEdge(
            "base",
            f"frame_{n}_{edge}",
            "dynamic",
            f"owner_{n}",
            f"/owner_{n}",
            pose=Pose(),
            rate=RATE,
            source=SourceLine("bench.yaml", n),
        )
        for n in range(NODES)
        for edge in range(EDGES)
    )
    owners = (
        PlanProcess(
            f"owner_{n}",
            "external",
            nodes=(f"/owner_{n}",),
            owns=tuple(("base", f"frame_{n}_{edge}") for edge in range(EDGES)),
        )
        for n in range(NODES)
    )
    guard = PlanProcess("guard", "guard", nodes=("/bench/guard",))
    return Plan("bench", "0", "base", RosSettings(), edges, (*owners, guard))


OWNERS = (PROGRAMS / "burst_owners.py", str(NODES), str(EDGES), str(RATE))
BENCHMARK = Benchmark(
    name="bursts",
    about=f"{NODES} nodes send {EDGES} edges each in one message at the same moment; plain rclpy"
    " decodes them and does no more",
    rows={
        "findings": Row(
            f"bursts: {NODES} nodes at {RATE} Hz in phase, false findings of the guard in 10 s",
            "findings",
            (Limit(0, "worst"),),
        ),
        "core": Row("… the guard", "% of a core"),
    },
    contenders=contenders(plan(), OWNERS, seconds=10.0),
    runs=5,
    quick_runs=1,
)
