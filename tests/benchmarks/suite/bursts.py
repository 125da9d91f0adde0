"""The guard of many nodes that publish at the same moment."""

from __future__ import annotations

from tests.benchmarks.benchmark import Benchmark, Limit, Row
from tests.benchmarks.fixed_robot import PROGRAMS
from tests.benchmarks.guarding import contenders, plan_of

NODES, EDGES, RATE = 100, 10, 10
OWNED = {f"owner_{n}": [f"frame_{n}_{edge}" for edge in range(EDGES)] for n in range(NODES)}
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
    contenders=contenders(plan_of(OWNED, RATE), OWNERS, seconds=10.0),
    runs=5,
    quick_runs=1,
)
