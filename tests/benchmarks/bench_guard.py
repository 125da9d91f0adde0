"""What the guard costs: ``python tests/benchmarks/bench_guard.py``, or name the file to pytest.

One owner sends 1,000 edges at 50 Hz in messages of 100. What is measured is the processor time of the guard's own
process, as a part of one core, in rounds of some seconds.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median

import psutil
import pytest

from tfcompose.geometry import Pose
from tfcompose.plan import Plan, PlanEdge, PlanProcess, RosSettings, SourceLine
from tfcompose.plan.file import write_plan

EDGES, TOGETHER, HERTZ = 1000, 100, 50.0
ROUNDS, ROUND_S = 3, 4.0
LIMIT = 0.10
DOMAIN = "101"
OWNER = f"""
import time
from tfcompose.ros.tf_codec import Template
from tfcompose.ros.node import TFPublisher, open_node
with open_node("owner", "/bench") as node:
    publisher = TFPublisher(node, static=False)
    names = [("base", f"frame_{{n}}_link") for n in range({EDGES})]
    templates = [Template(names[at : at + {TOGETHER}]) for at in range(0, {EDGES}, {TOGETHER})]
    due = time.monotonic()
    while True:
        for template in templates:
            template.set_stamp(time.time_ns())
            publisher.publish(template.data)
        due += 1 / {HERTZ}
        time.sleep(max(0.0, due - time.monotonic()))
"""


def plan() -> Plan:
    """Return the plan whose edges the owner sends."""
    edges = tuple(
        PlanEdge(
            "base", f"frame_{n}_link", "dynamic", "owner", "/bench/owner", Pose(), HERTZ, SourceLine("bench.yaml", n)
        )
        for n in range(EDGES)
    )
    owns = tuple((edge.parent, edge.child) for edge in edges)
    processes = (
        PlanProcess("owner", "external", nodes=("/bench/owner",), owns=owns),
        PlanProcess("guard", "guard", nodes=("/bench/guard",)),
    )
    return Plan("bench", "0", "base", RosSettings(), edges, processes)


def measure() -> list[float]:
    """Return the part of a core that the guard uses, for each round.

    Raises:
        RuntimeError: if the guard did not see every edge, or found something wrong.
    """
    with tempfile.TemporaryDirectory() as folder:
        file, log = Path(folder, "plan.json"), Path(folder, "said.txt")
        file.write_text(write_plan(plan()), encoding="utf-8")
        with log.open("wb") as out:
            guard = subprocess.Popen([sys.executable, "-m", "tfcompose.guard", str(file), "guard"], stdout=out)
        owner = subprocess.Popen([sys.executable, "-c", OWNER])
        try:
            return _rounds(psutil.Process(guard.pid), log)
        finally:
            for process in (owner, guard):
                process.terminate()
                process.wait(20)


def _rounds(guard: psutil.Process, log: Path) -> list[float]:
    end = time.monotonic() + 30
    while '"Complete"' not in log.read_text("utf-8"):
        if time.monotonic() > end:
            raise RuntimeError("the guard did not see every edge")
        time.sleep(0.1)
    parts = []
    for _ in range(ROUNDS):
        before, begun = sum(guard.cpu_times()[:2]), time.monotonic()
        time.sleep(ROUND_S)
        parts.append((sum(guard.cpu_times()[:2]) - before) / (time.monotonic() - begun))
    if '"error"' in log.read_text("utf-8"):
        raise RuntimeError("the guard found something wrong")
    return parts


@pytest.mark.ros
def test_a_guard_of_1000_edges_at_50_hz_uses_under_a_tenth_of_a_core(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", DOMAIN)
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    found = measure()
    assert median(found) < LIMIT, found


if __name__ == "__main__":
    os.environ.update(ROS_DOMAIN_ID=DOMAIN, ROS_AUTOMATIC_DISCOVERY_RANGE="LOCALHOST")
    for part in measure():
        sys.stdout.write(f"{100 * part:5.1f} % of a core for {EDGES} edges at {HERTZ:g} Hz\n")
