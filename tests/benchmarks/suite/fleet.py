"""Twenty robots of a fleet on loopback.

Each robot is a process with the code of ``fleet share``, fed with 50 transforms a second of odom →
base_link instead of by ROS, and has a Zenoh router, in a process for all of them.
"""

from __future__ import annotations

import time
from contextlib import ExitStack, contextmanager
from itertools import pairwise
from statistics import median, quantiles
from typing import TYPE_CHECKING

import psutil

from tests.benchmarks.benchmark import TFCOMPOSE, Benchmark, Limit, Row
from tests.benchmarks.measures import cpu_s
from tests.support.fleets import RobotProcesses
from tfcompose.tools.fleet.observe import FleetObserver

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from tests.benchmarks.benchmark import Sampler, Workspace

ROBOTS, SECONDS, TIMEOUT_S = 20, 5.0, 120.0
RATES = (5, 10, 20)


@contextmanager
def fleet(_: Workspace) -> Iterator[Sampler]:
    """Run the robots anew at each rate."""

    def sample() -> Mapping[str, float]:
        values: dict[str, float] = {}
        for rate in RATES:
            ages_ms, core = _measure(rate)
            values |= {
                f"median_{rate}": median(ages_ms),
                f"p95_{rate}": quantiles(ages_ms, n=20)[-1],
                f"core_{rate}": core,
            }
        return values

    yield sample


def _measure(rate: int) -> tuple[list[float], float]:
    """Return the ages of poses between neighbours in ms, and a robot's share of a core in percent.

    Raises:
        RuntimeError: if not every robot came.
    """
    with RobotProcesses(ROBOTS, f"{rate} Hz") as running, ExitStack() as stack:
        processes = [psutil.Process(process.pid) for process in running.processes.values()]
        observer = FleetObserver(running.fleet)
        stack.callback(observer.close)
        if not observer.wait(TIMEOUT_S):
            raise RuntimeError("not every robot came")
        ages_ms = []
        used, began = cpu_s(processes), time.monotonic()
        pairs = list(pairwise(f"{name}/base_link" for name in running.fleet.robots))
        while time.monotonic() - began < SECONDS:
            for target, source in pairs:
                _, stamp_ns = observer.buffer.latest(target, source)
                ages_ms.append((time.time_ns() - (stamp_ns or 0)) / 1e6)
            time.sleep(0.037)  # a multiple of no period, so that it meets all phases
        core = 100 * (cpu_s(processes) - used) / (time.monotonic() - began)
    return ages_ms, core / ROBOTS


def _rows(rate: int) -> dict[str, Row]:
    limited = rate == 10
    return {
        f"median_{rate}": Row(
            f"each edge at {rate} Hz: age of a pose between two robots, median",
            "ms",
            (Limit(100.0, "least"),) if limited else (),
        ),
        f"p95_{rate}": Row("… 95th percentile", "ms"),
        f"core_{rate}": Row(
            "… each robot", "% of a core", (Limit(5.0, "least"),) if limited else ()
        ),
    }


BENCHMARK = Benchmark(
    name="fleet",
    about="twenty robots and their Zenoh routers on one machine; half a period of the age is the"
    " rate's",
    rows=_rows(5) | _rows(10) | _rows(20),
    contenders={TFCOMPOSE: fleet},
    runs=3,
    quick_runs=1,
)
