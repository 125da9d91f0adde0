"""How soon a running robot reacts.

``python tests/benchmarks/bench_reactions.py``, or name the file to pytest.

A robot with an owner at 50 Hz runs under ``up``. Measured are the seconds from a stranger's first
message until the guard's line names it; from an owner's standstill until its line says so; and
from the launcher's SIGKILL until the last of its processes has ended. Medians of some runs.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import contextmanager
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING

import psutil
import pytest

from tfcompose.tf.ros.node import TFPublisher, open_node
from tfcompose.tf.ros.tf_codec import SentTransform, encode

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

RUNS = 5
#: At most, in seconds.
NAMED_S, SILENT_S, ENDED_S = 1.0, 1.0, 2.0
TIMEOUT_S = 30.0
DOMAIN = "98"
ROBOT = """
tfcompose: 1
robot: bench
ros: {discovery: localhost}
frames:
  odom: {}
  base_link: {parent: odom, owner: drive, rate: 50 Hz}
processes:
  drive: {simulate: {fixed: {}, rate: 50 Hz}}
"""


@contextmanager
def running(folder: Path) -> Iterator[tuple[psutil.Process, Path]]:
    """Run the robot until its tree is complete; give its launcher and what it prints."""
    (folder / "robot.yaml").write_text(ROBOT, encoding="utf-8")
    output = folder / "output.txt"
    with output.open("wb") as out:
        up = subprocess.Popen(
            [sys.executable, "-m", "tfcompose", "up"], cwd=folder, stdout=out, stderr=out
        )
    try:
        seconds_until(lambda: "tree complete" in output.read_text("utf-8"))
        yield psutil.Process(up.pid), output
    finally:
        up.send_signal(signal.SIGINT)
        up.wait(TIMEOUT_S)


def seconds_until(condition: Callable[[], bool]) -> float:
    """Wait until the condition holds, and return how long that took.

    Raises:
        RuntimeError: if it does not hold in time.
    """
    begun = time.monotonic()
    while not condition():
        if time.monotonic() > begun + TIMEOUT_S:
            raise RuntimeError("it did not come to pass")
        time.sleep(0.002)
    return time.monotonic() - begun


def named_s(output: Path, name: str) -> float:
    """Return how long it takes to name a stranger on the owner's edge.

    The time runs from its first message that is received.
    """
    with open_node(name, "/bench") as node:
        publisher = TFPublisher(node, static=False)
        seconds_until(lambda: publisher.publisher.get_subscription_count() > 0)

        def is_named() -> bool:
            stranger = SentTransform(
                time.time_ns(), "odom", "base_link", (1.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)
            )
            publisher.publish(encode([stranger]))
            return f"published by /bench/{name};" in output.read_text("utf-8")

        return seconds_until(is_named)


def silent_s(launcher: psutil.Process, output: Path) -> float:
    """Return how long it takes until an owner that stands still is said to have fallen silent."""
    (drive,) = [process for process in launcher.children() if "drive" in process.cmdline()[-1:]]
    before = output.read_text("utf-8").count("fell silent")
    drive.suspend()
    try:
        return seconds_until(lambda: output.read_text("utf-8").count("fell silent") > before)
    finally:
        drive.resume()
        seconds_until(lambda: output.read_text("utf-8").count("is back after") > before)


def ended_s(launcher: psutil.Process) -> float:
    """Return how long it takes until everything has ended of which the launcher is killed."""
    below = launcher.children(recursive=True)
    launcher.kill()
    return seconds_until(
        lambda: not any(each.is_running() and each.status() != "zombie" for each in below)
    )


def measure() -> dict[str, float]:
    """Return the median of each reaction, in seconds."""
    found: dict[str, list[float]] = {"named": [], "silent": [], "ended": []}
    for number in range(RUNS):
        with tempfile.TemporaryDirectory() as folder, running(Path(folder)) as (launcher, output):
            found["named"].append(named_s(output, f"stranger_{number}"))
            found["silent"].append(silent_s(launcher, output))
            found["ended"].append(ended_s(launcher))
    return {what: median(values) for what, values in found.items()}


@pytest.mark.ros
def test_strangers_and_silence_are_named_within_a_second_and_everything_ends_within_two(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", DOMAIN)
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    found = measure()
    assert found["named"] < NAMED_S, found
    assert found["silent"] < SILENT_S, found
    assert found["ended"] < ENDED_S, found


if __name__ == "__main__":
    os.environ.update(ROS_DOMAIN_ID=DOMAIN, ROS_AUTOMATIC_DISCOVERY_RANGE="LOCALHOST")
    for what, value in measure().items():
        sys.stdout.write(f"{what:<8}{value:6.3f} s\n")
