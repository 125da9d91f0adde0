"""What the guard costs: ``python -m tests.benchmarks.bench_guard``, or name the file to pytest.

One owner sends 1,000 edges at 50 Hz in messages of 100. What is measured is the processor time of
the guard's own process, as a part of one core, in rounds of some seconds; and beside it, in the
same rounds, that of a plain rclpy node that decodes the same messages.
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

from tests.benchmarks.results import record
from tfcompose.foundation.geometry import Pose
from tfcompose.launcher.program import HERE
from tfcompose.model.plan import Plan, PlanEdge, PlanProcess, RosSettings, SourceLine
from tfcompose.model.plan.file import write_plan

EDGES, TOGETHER, HERTZ = 1000, 100, 50.0
ROUNDS, ROUND_S = 3, 4.0
LIMIT = 0.10
DOMAIN = "101"
OWNER = f"""
import time
from tfcompose.tf.ros.tf_codec import Template
from tfcompose.tf.ros.node import TFPublisher, open_node
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


#: A plain node that hears the same messages, and decodes them.
LISTENER = """
import rclpy
from tfcompose.tf.ros.tf_codec import Decoder
from tfcompose.tf.ros.typesupport import tf_message_type
rclpy.init()
node, decoder = rclpy.create_node("listener"), Decoder()
def take(data):
    for row in decoder.rows(data):
        pass
node.create_subscription(tf_message_type(), "/tf", take, 1000, raw=True)
rclpy.spin(node)
"""


def plan() -> Plan:
    """Return the plan whose edges the owner sends."""
    edges = tuple(
        PlanEdge(
            "base",
            f"frame_{n}_link",
            "dynamic",
            "owner",
            "/bench/owner",
            Pose(),
            HERTZ,
            SourceLine("bench.yaml", n),
        )
        for n in range(EDGES)
    )
    owns = tuple((edge.parent, edge.child) for edge in edges)
    processes = (
        PlanProcess("owner", "external", nodes=("/bench/owner",), owns=owns),
        PlanProcess("guard", "guard", nodes=("/bench/guard",)),
    )
    return Plan("bench", "0", "base", RosSettings(), edges, processes)


def measure() -> list[tuple[float, float]]:
    """Return the parts of a core that the guard and the plain listener use, for each round.

    Raises:
        RuntimeError: if the guard did not see every edge, or found something wrong.
    """
    with tempfile.TemporaryDirectory() as folder:
        file, log = Path(folder, "plan.json"), Path(folder, "said.txt")
        file.write_text(write_plan(plan()), encoding="utf-8")
        with log.open("wb") as out:
            guard = subprocess.Popen([*HERE, "guard", str(file), "guard"], stdout=out)
        listener, owner = (
            subprocess.Popen([sys.executable, "-c", code]) for code in (LISTENER, OWNER)
        )
        try:
            return _rounds([psutil.Process(one.pid) for one in (guard, listener)], log)
        finally:
            for process in (owner, listener, guard):
                process.kill()
                process.wait()


def _rounds(processes: list[psutil.Process], log: Path) -> list[tuple[float, float]]:
    end = time.monotonic() + 30
    while '"TreeComplete"' not in log.read_text("utf-8"):
        if time.monotonic() > end:
            raise RuntimeError("the guard did not see every edge")
        time.sleep(0.1)
    time.sleep(5)  # until a stock listener surely hears, and interpreters have warmed up
    parts = []
    for _ in range(ROUNDS):
        before, begun = [_used_s(one) for one in processes], time.monotonic()
        time.sleep(ROUND_S)
        passed = time.monotonic() - begun
        guard, listener = (
            (_used_s(one) - was) / passed for one, was in zip(processes, before, strict=True)
        )
        parts.append((guard, listener))
    if '"error"' in log.read_text("utf-8"):
        raise RuntimeError("the guard found something wrong")
    return parts


def _used_s(process: psutil.Process) -> float:
    return float(sum(process.cpu_times()[:2]))


def both() -> tuple[float, float]:
    """Return the median parts of a core of the guard and of the plain listener."""
    found = measure()
    return median(guard for guard, _ in found), median(listener for _, listener in found)


@pytest.mark.ros
def test_a_guard_of_1000_edges_at_50_hz_uses_a_tenth_of_a_core_or_less_than_a_plain_listener(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", DOMAIN)
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    guard, listener = both()
    assert guard < max(LIMIT, listener), (guard, listener)


if __name__ == "__main__":
    os.environ.update(ROS_DOMAIN_ID=DOMAIN, ROS_AUTOMATIC_DISCOVERY_RANGE="LOCALHOST")
    before = os.getloadavg()[0]
    guard_part, listener_part = both()
    cells = [
        f"{100 * guard_part:.0f} % of a core",
        f"{100 * listener_part:.0f} %: a plain rclpy listener that decodes",
    ]
    record("guard", {f"the guard, with {EDGES:,} edges at {HERTZ:g} Hz": cells}, before)
