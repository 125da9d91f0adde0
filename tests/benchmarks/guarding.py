"""Observers of moving edges that an external process sends: the guard, and a plain listener."""

from __future__ import annotations

import sys
import time
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

import psutil

from tests.benchmarks.contenders import RCLPY, TFCOMPOSE_ON_ROS
from tests.benchmarks.fixed_robot import PROGRAMS
from tests.benchmarks.measures import cpu_s
from tests.support.waiting import until
from tfcompose.foundation.geometry import Pose
from tfcompose.launcher.program import HERE
from tfcompose.model.plan import Plan, PlanEdge, PlanProcess, RosSettings, SourceLine
from tfcompose.model.plan.file import write_plan

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence
    from contextlib import AbstractContextManager
    from pathlib import Path

    from tests.benchmarks.benchmark import Contender, Opened, Sampler, Workspace

COMPLETE_S, WARM_UP_S = 60.0, 5.0


@dataclass(frozen=True)
class Observer:
    """A process that receives the edges."""

    process: psutil.Process
    #: How many findings it has reported; a plain listener reports none.
    findings: Callable[[], int] | None = None


@contextmanager
def guard(workspace: Workspace, plan: Plan) -> Iterator[Observer]:
    """Run the guard of a plan.

    Raises:
        RuntimeError: if it does not receive every edge.
    """
    file, output = workspace.folder / "plan.json", workspace.folder / "output.txt"
    file.write_text(write_plan(plan), encoding="utf-8")
    with (
        output.open("wb") as out,
        workspace.running(*HERE, "guard", file, "guard", stdout=out) as process,
    ):
        if not until(lambda: '"TreeComplete"' in output.read_text("utf-8"), COMPLETE_S):
            raise RuntimeError("the guard did not receive every edge")
        yield Observer(
            psutil.Process(process.pid),
            lambda: output.read_text("utf-8").count('"FindingShown"'),
        )


@contextmanager
def listener(workspace: Workspace, plan: Plan) -> Iterator[Observer]:
    """Run a plain rclpy node that decodes what comes."""
    del plan
    with workspace.running(sys.executable, PROGRAMS / "decoder.py") as process:
        yield Observer(psutil.Process(process.pid))


def opened(
    observer: Callable[[Workspace, Plan], AbstractContextManager[Observer]],
    plan: Plan,
    owner: Sequence[str | Path],
    seconds: float,
) -> Opened:
    """Return the function that opens an observer, with an owner in its own domain.

    A run has the row ``core``, and ``findings`` of the guard.
    """

    @contextmanager
    def observed(workspace: Workspace) -> Iterator[Sampler]:
        with workspace.running(sys.executable, *owner), observer(workspace, plan) as running:
            time.sleep(WARM_UP_S)  # until a stock listener surely receives

            def sample() -> Mapping[str, float]:
                before = running.findings() if running.findings else 0
                used, began = cpu_s([running.process]), time.monotonic()
                time.sleep(seconds)
                took_s = time.monotonic() - began
                values = {"core": 100 * (cpu_s([running.process]) - used) / took_s}
                if running.findings:
                    values["findings"] = running.findings() - before
                return values

            yield sample

    return observed


def plan_of(owned: Mapping[str, Sequence[str]], rate: float) -> Plan:
    """Return the plan of owners in external nodes: frames below base, each sent at that rate."""
    edges = tuple(
        PlanEdge(
            "base",
            frame,
            "dynamic",
            owner,
            f"/{owner}",
            pose=Pose(),
            rate=rate,
            source=SourceLine("bench.yaml", line),
        )
        for line, owner in enumerate(owned)
        for frame in owned[owner]
    )
    owners = (
        PlanProcess(
            owner,
            "external",
            nodes=(f"/{owner}",),
            owns=tuple(("base", frame) for frame in frames),
        )
        for owner, frames in owned.items()
    )
    guarding = PlanProcess("guard", "guard", nodes=("/bench/guard",))
    return Plan("bench", "0", "base", RosSettings(), edges, (*owners, guarding))


def contenders(plan: Plan, owner: Sequence[str | Path], seconds: float) -> dict[Contender, Opened]:
    """Return the guard of the plan, and a plain listener, of what an owner sends."""
    return {
        TFCOMPOSE_ON_ROS: opened(guard, plan, owner, seconds),
        RCLPY: opened(listener, plan, owner, seconds),
    }
