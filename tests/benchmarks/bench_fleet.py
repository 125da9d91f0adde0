"""Twenty robots of a fleet on loopback.

``python -m tests.benchmarks.bench_fleet [--record]``, or name it to pytest.

Each robot is a process with the code of ``fleet share``, fed with 50 transforms a second of odom →
base_link instead of by ROS, and has a Zenoh router, in a process for all of them. How old a pose
between two robots is depends on the rate: half a period at the median, and what it takes on the
way.
"""

from __future__ import annotations

import os
import time
from contextlib import ExitStack
from itertools import pairwise
from statistics import median, quantiles

import psutil

from tests.benchmarks.results import Rows, record
from tests.support.fleets import RobotProcesses
from tests.support.waiting import until
from tfcompose.tools.fleet.observe import FleetObserver

ROBOTS, SECONDS = 20, 10.0
RATES = ("5 Hz", "10 Hz", "20 Hz")
#: A pose between two robots at 10 Hz is no older at the median, in seconds; a robot costs no more
#: of a core.
LIMIT_S, LIMIT_CORE = 0.1, 0.05


def measure(
    rate: str, robots: int = ROBOTS, seconds: float = SECONDS
) -> tuple[list[float], float]:
    """Return the ages of poses between neighbours in seconds, and a robot's share of a core."""
    with RobotProcesses(robots, rate) as running, ExitStack() as stack:
        fleet = running.fleet
        processes = [psutil.Process(one.pid) for one in running.processes.values()]
        observer = FleetObserver(fleet)
        stack.callback(observer.close)
        if not observer.wait(120):
            raise RuntimeError("not every robot came")
        ages = []
        before, begun = _cpu_s(processes), time.monotonic()
        pairs = list(pairwise(f"{name}/base_link" for name in fleet.robots))
        while time.monotonic() - begun < seconds:
            for one, other in pairs:
                _, stamp_ns = observer.buffer.latest(one, other)
                ages.append((time.time_ns() - (stamp_ns or 0)) / 1e9)
            time.sleep(0.037)  # of no period, so that all phases are met
        spent_s = (_cpu_s(processes) - before) / (time.monotonic() - begun)
    return ages, spent_s / robots


def _cpu_s(processes: list[psutil.Process]) -> float:
    return sum(sum(one.cpu_times()[:2]) for one in processes)


def test_poses_between_robots_are_young_and_robots_cheap() -> None:
    limits: list[float] = []

    def is_young_and_cheap() -> bool:
        ages, core = measure("10 Hz", seconds=3.0)
        limits[:] = [median(ages), core]
        return median(ages) <= LIMIT_S and core <= LIMIT_CORE

    assert until(is_young_and_cheap), limits


def main() -> None:
    """Measure at each rate, and print a row for it."""
    load = os.getloadavg()[0]
    rows: Rows = {}
    for rate in RATES:
        ages, core = measure(rate)
        cells = [
            f"{1e3 * median(ages):.0f} ms",
            f"{1e3 * quantiles(ages, n=20)[-1]:.0f} ms",
            f"{core:.1%}",
        ]
        rows[f"each edge at {rate}"] = cells
    record("fleet", rows, load)


if __name__ == "__main__":
    main()
