"""What ``joints`` costs and how late it is.

``python -m tests.benchmarks.bench_joints``, or name the file to pytest.

A node of the benchmark sends joint states at 500 Hz and hears /tf. Figures are the process's CPU
time (user and system) per second, and the time from a joint state's publishing to the transforms'
being taken. Several runs; the least of each counts, since what else the machine does only adds.
Beside them a plain rclpy node is measured that answers each joint state's bytes with bytes that it
has ready: what waking up and DDS alone cost on this machine today.
"""

from __future__ import annotations

import faulthandler
import os
import struct
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Any

import pytest

from tests.benchmarks.results import record
from tfcompose.foundation.geometry import Pose
from tfcompose.launcher.program import HERE
from tfcompose.model.plan import Plan, PlanEdge, PlanJoint, PlanProcess, RosSettings, SourceLine
from tfcompose.model.plan.file import write_plan

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.benchmarks.results import Rows

RATE = 500
SECONDS = 3.0
RUNS = 3
#: All runs together take no longer, wherever ROS may wait for itself.
LONGEST_S = 300.0
#: Joints: at most this part of a core, and this median, in seconds.
LIMITS = {100: (0.12, 0.6e-3), 500: (0.25, 1e-3)}
DOMAIN = "100"
#: A plain node that reads nothing and computes nothing.
PLAIN = """
import contextlib
import rclpy
from rclpy.executors import ExternalShutdownException
from sensor_msgs.msg import JointState
from tfcompose.tf.ros.tf_codec import Template
from tfcompose.tf.ros.typesupport import tf_message_type
rclpy.init()
node = rclpy.create_node("plain", namespace="/rover")
data = Template([("link_0", "link_1")]).data
publisher = node.create_publisher(tf_message_type(), "/tf", 100)
node.create_subscription(JointState, "joint_states", lambda _: publisher.publish(data), 10, raw=True)
with contextlib.suppress(ExternalShutdownException):
    rclpy.spin(node)
"""  # noqa: E501 (a text as its reader has it)


def cpu_s(pid: int) -> float:
    """Return the seconds of CPU that the process has used, in all its threads."""
    tasks = Path(f"/proc/{pid}/task").iterdir()
    return sum(int((task / "schedstat").read_text().split()[0]) for task in tasks) / 1e9


def pss_mb(pid: int) -> float:
    """Return the memory of the process, shared pages divided among those who share them."""
    lines = Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()
    return next(int(line.split()[1]) / 1024 for line in lines if line.startswith("Pss:"))


def plan_file(folder: Path, joints: int) -> Path:
    """Write the plan of a robot with so many joints."""
    edges = tuple(
        PlanEdge(
            f"link_{n}",
            f"link_{n + 1}",
            "joint",
            "joints",
            "/rover/joints",
            Pose((0.1, 0.0, 0.2)),
            None,
            SourceLine("r", 1),
            PlanJoint(f"joint_{n}", "revolute", (0.0, 0.0, 1.0)),
        )
        for n in range(joints)
    )
    processes = (PlanProcess("joints", "joints", nodes=("/rover/joints",)),)
    file = folder / "plan.json"
    file.write_text(
        write_plan(Plan("rover", "", "link_0", RosSettings("/rover"), edges, processes))
    )
    return file


def measure(
    joints: int, seconds: float = SECONDS, *, plain: bool = False
) -> tuple[float, float, float, float]:
    """Return the share of a core, median and 99th percentile of the delay in seconds, and MB."""
    from tfcompose.tf.ros.node import open_node  # noqa: PLC0415 (after ROS's variables are set)

    with tempfile.TemporaryDirectory() as folder, open_node("bench", "/rover") as node:
        words = [*HERE, "joints", str(plan_file(Path(folder), joints)), "joints"]
        command = [sys.executable, "-c", PLAIN] if plain else words
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
        try:
            return _measure(process.pid, _sender(node, joints), seconds)
        finally:
            process.kill()
            process.wait()


def _sender(node: Any, joints: int) -> Callable[[], float | None]:
    """Return a function that sends a joint state and returns how long its answer took.

    It waits for the rest of its period.
    """
    # After ROS's variables are set.
    from rclpy.serialization import serialize_message  # noqa: PLC0415
    from sensor_msgs.msg import JointState  # noqa: PLC0415 (the same)

    from tfcompose.foundation.signals import Stop  # noqa: PLC0415 (the same)
    from tfcompose.tf.ros.node import TFSubscription, wait  # noqa: PLC0415 (the same)

    message = JointState(
        name=[f"joint_{n}" for n in range(joints)], position=[0.01 * n for n in range(joints)]
    )
    data = bytearray(serialize_message(message))
    publisher = node.create_publisher(JointState, "joint_states", 10)
    heard, stop = TFSubscription(node, static=False), Stop()

    def send() -> float | None:
        start_ns, due, delay = time.time_ns(), time.monotonic() + 1 / RATE, None
        struct.pack_into("<iI", data, 4, *divmod(start_ns, 1_000_000_000))
        publisher.publish(bytes(data))
        while (left := due - time.monotonic()) > 0:
            wait(node, [heard], left, stop)
            for _ in heard.take():
                delay = (time.time_ns() - start_ns) / 1e9
        return delay

    return send


def _measure(
    pid: int, send: Callable[[], float | None], seconds: float
) -> tuple[float, float, float, float]:
    end = time.monotonic() + 20
    while send() is None:
        if time.monotonic() > end:
            raise TimeoutError("nothing came on /tf")
    end = time.monotonic() + 1.0
    while time.monotonic() < end:
        send()
    used, end, delays, sent = cpu_s(pid), time.monotonic() + seconds, [], 0
    while time.monotonic() < end:
        delay = send()
        sent += 1
        if delay is not None:
            delays.append(delay)
    if len(delays) < sent / 2:
        raise TimeoutError(f"{len(delays)} of {sent} joint states were answered in time")
    used = cpu_s(pid) - used
    return used * RATE / sent, median(delays), sorted(delays)[len(delays) * 99 // 100], pss_mb(pid)


def best(joints: int, *, plain: bool = False) -> tuple[float, ...]:
    """Return the least of each figure in several runs."""
    runs = [measure(joints, plain=plain) for _ in range(RUNS)]
    return tuple(min(values) for values in zip(*runs, strict=True))


@pytest.mark.ros
@pytest.mark.parametrize("joints", LIMITS)
def test_joints_cost_little_and_are_in_time(joints: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", DOMAIN)
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    core, middle, _, _ = best(joints)
    most, latest = LIMITS[joints]
    if core >= most:  # where waking up alone costs more, that is the machine's doing
        most = best(joints, plain=True)[0]
    assert core < most
    assert middle < latest


def rows() -> Rows:
    """Measure what the README prints, beside it the plain process of the same run, in turns."""
    found: Rows = {}
    for joints in LIMITS:
        runs: dict[bool, list[tuple[float, ...]]] = {False: [], True: []}
        for _ in range(RUNS):
            for plain, some in runs.items():
                some.append(measure(joints, plain=plain))
        (core, middle, late, memory), (least, soonest, _, _) = (
            tuple(min(values) for values in zip(*some, strict=True)) for some in runs.values()
        )
        times = f"{1e3 * middle:.2f} ms at the median, {1e3 * late:.2f} ms at the 99th percentile"
        found[f"`joints`: {joints} joints at {RATE} Hz"] = [
            f"{100 * core:.0f} % of a core, {times}, {memory:.0f} MB",
            (
                f"{100 * least:.0f} %, {1e3 * soonest:.2f} ms: plain rclpy that answers each"
                " message with ready bytes"
            ),
        ]
    return found


if __name__ == "__main__":
    faulthandler.dump_traceback_later(LONGEST_S, exit=True)  # with where it hangs
    os.environ.update(ROS_DOMAIN_ID=DOMAIN, ROS_AUTOMATIC_DISCOVERY_RANGE="LOCALHOST")
    before = os.getloadavg()[0]
    record("joints", rows(), before)
