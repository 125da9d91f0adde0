"""Many publishers that send at the same moment: more datagrams than a socket holds by itself."""

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support import processes
from tests.support.processes import Started
from tests.support.waiting import until
from tfcompose.foundation.geometry import Pose
from tfcompose.launcher.program import HERE
from tfcompose.model.plan import Plan, PlanEdge, PlanProcess, RosSettings, SourceLine
from tfcompose.model.plan.file import write_plan

pytestmark = [pytest.mark.ros, pytest.mark.slow, pytest.mark.alone]

PUBLISHERS, EDGES, HERTZ = 100, 20, 10.0
SECONDS = 20.0
#: Owners that send in phase, each its edges in one message; a line read makes owner_0 silent.
OWNERS = f"""
import select, sys, time
from rclpy.context import Context
from rclpy.node import Node
from tfcompose.tf.ros.node import TFPublisher
from tfcompose.tf.ros.tf_codec import Template
context = Context()
context.init()
owners = []
for n in range({PUBLISHERS}):
    node = Node(f"owner_{{n}}", context=context, enable_rosout=False)
    names = [("base", f"frame_{{n}}_{{edge}}") for edge in range({EDGES})]
    owners.append((TFPublisher(node, static=False), Template(names)))
due, late = time.monotonic(), 0.0
while True:
    for publisher, template in owners:
        template.set_stamp(time.time_ns())
        publisher.publish(template.data)
    due += 1 / {HERTZ}
    if time.monotonic() > due + 0.4:
        print("late", flush=True)
    time.sleep(max(0.0, due - time.monotonic()))
    if select.select([sys.stdin], [], [], 0)[0] and sys.stdin.readline():
        del owners[0]
"""


def plan() -> Plan:
    owners = [
        (f"owner_{n}", [f"frame_{n}_{edge}" for edge in range(EDGES)]) for n in range(PUBLISHERS)
    ]
    line = SourceLine("rover.yaml", 3)
    edges = [
        PlanEdge("base", child, "dynamic", owner, f"/{owner}", Pose(), HERTZ, line)
        for owner, children in owners
        for child in children
    ]
    external = [PlanProcess(owner, "external", nodes=(f"/{owner}",)) for owner, _ in owners]
    guard = PlanProcess("guard", "guard", nodes=("/guard",))
    return Plan("rover", "0", "base", RosSettings(), tuple(edges), (*external, guard))


@pytest.fixture
def guard(tmp_path: Path) -> Iterator[Started]:
    file = tmp_path / "plan.json"
    file.write_text(write_plan(plan()))
    yield from started([*HERE, "guard", str(file), "guard"])


@pytest.fixture
def owners() -> Iterator[Started]:
    yield from started([sys.executable, "-c", OWNERS])


def started(command: list[str]) -> Iterator[Started]:
    pipes = dict.fromkeys(("stdin", "stdout", "stderr"), subprocess.PIPE)
    process = Started(processes.start(command, **pipes))
    yield process
    process.close()


def test_nobody_in_a_burst_is_called_silent_but_who_is(guard: Started, owners: Started) -> None:
    guard.until_says("TreeComplete")
    until(lambda: owners.process.poll() is not None, SECONDS)
    if "late" in owners.output:
        pytest.skip("this machine is too busy to send in time")
    assert "TF8" not in guard.output, guard.lines
    assert owners.process.stdin
    owners.process.stdin.write("\n")
    owners.process.stdin.flush()
    assert until(lambda: "TF804" in guard.output, 2.0)
