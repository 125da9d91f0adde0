"""The guard of many moving edges, beside a plain rclpy node that decodes the same messages."""

from __future__ import annotations

import sys
import time
from contextlib import contextmanager
from typing import TYPE_CHECKING

import psutil

from tests.benchmarks.benchmark import Benchmark, Contender, Limit, Opened, Row
from tests.benchmarks.contenders import RCLPY, TFCOMPOSE_ON_ROS
from tests.benchmarks.fixed_robot import PROGRAMS
from tests.benchmarks.measures import cpu_s
from tests.support.waiting import until
from tfcompose.foundation.geometry import Pose
from tfcompose.launcher.program import HERE
from tfcompose.model.plan import Plan, PlanEdge, PlanProcess, RosSettings, SourceLine
from tfcompose.model.plan.file import write_plan

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping
    from contextlib import AbstractContextManager

    from tests.benchmarks.benchmark import Sampler, Workspace

EDGES, EDGES_A_MESSAGE, RATE = 1000, 100, 50
ROUND_S, WARM_UP_S = 4.0, 5.0


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


@contextmanager
def guarding(workspace: Workspace) -> Iterator[psutil.Process]:
    """Run the guard.

    Raises:
        RuntimeError: if it did not receive every edge, or finds an error.
    """
    file, output = workspace.folder / "plan.json", workspace.folder / "output.txt"
    file.write_text(write_plan(plan()), encoding="utf-8")
    with (
        output.open("wb") as out,
        workspace.running(*HERE, "guard", file, "guard", stdout=out) as process,
    ):
        if not until(lambda: '"TreeComplete"' in output.read_text("utf-8"), 30):
            raise RuntimeError("the guard did not receive every edge")
        yield psutil.Process(process.pid)
        if '"error"' in output.read_text("utf-8"):
            raise RuntimeError("the guard found an error")


@contextmanager
def listening(workspace: Workspace) -> Iterator[psutil.Process]:
    """Run a plain listener."""
    with workspace.running(sys.executable, PROGRAMS / "decoder.py") as process:
        yield psutil.Process(process.pid)


def opened(observer: Callable[[Workspace], AbstractContextManager[psutil.Process]]) -> Opened:
    """Return the function that opens a contender, with an owner in its own domain."""

    @contextmanager
    def observed(workspace: Workspace) -> Iterator[Sampler]:
        size = (str(EDGES), str(RATE), str(EDGES_A_MESSAGE))
        owner = (sys.executable, PROGRAMS / "owner.py", "base", *size)
        with workspace.running(*owner), observer(workspace) as process:
            time.sleep(WARM_UP_S)  # until a stock listener surely receives

            def sample() -> Mapping[str, float]:
                used, began = cpu_s([process]), time.monotonic()
                time.sleep(ROUND_S)
                return {"core": 100 * (cpu_s([process]) - used) / (time.monotonic() - began)}

            yield sample

    return observed


CONTENDERS: dict[Contender, Callable[[Workspace], AbstractContextManager[psutil.Process]]] = {
    TFCOMPOSE_ON_ROS: guarding,
    RCLPY: listening,
}
BENCHMARK = Benchmark(
    name="guard",
    about="an owner sends edges in messages of 100; plain rclpy decodes them and does no more",
    rows={
        "core": Row(
            f"the guard, with {EDGES:,} edges at {RATE} Hz",
            "% of a core",
            (Limit(1.0, "least", times=RCLPY),),
        ),
    },
    contenders={contender: opened(observer) for contender, observer in CONTENDERS.items()},
    runs=5,
)
