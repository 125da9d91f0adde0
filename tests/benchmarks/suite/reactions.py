"""Time until a running robot reacts: to another publisher, to silence, and to its own end."""

from __future__ import annotations

import subprocess
import sys
import time
from contextlib import contextmanager
from itertools import count
from typing import TYPE_CHECKING

import psutil

from tests.benchmarks.benchmark import Benchmark, Limit, Row
from tests.benchmarks.contenders import TFCOMPOSE_ON_ROS

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping
    from pathlib import Path

    from tests.benchmarks.benchmark import Sampler, Workspace

TIMEOUT_S = 30.0
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
def robot(workspace: Workspace) -> Iterator[Sampler]:
    """Start the robot anew in each round."""
    (workspace.folder / "robot.yaml").write_text(ROBOT, encoding="utf-8")
    output, numbers = workspace.folder / "output.txt", count()
    up = (sys.executable, "-m", "tfcompose", "up")

    def sample() -> Mapping[str, float]:
        with (
            output.open("wb") as out,
            workspace.running(*up, stdout=out, stderr=subprocess.STDOUT) as process,
            workspace.entered(),
        ):
            seconds_until(lambda: "tree complete" in output.read_text("utf-8"))
            launcher = psutil.Process(process.pid)
            return {
                "named": named_s(output, f"stranger_{next(numbers)}"),
                "silent": silent_s(launcher, output),
                "ended": ended_s(launcher),
            }

    yield sample


def seconds_until(condition: Callable[[], bool]) -> float:
    """Wait until the condition holds, and return how long that took.

    Raises:
        RuntimeError: if it does not hold in time.
    """
    begun = time.monotonic()
    while not condition():
        if time.monotonic() > begun + TIMEOUT_S:
            raise RuntimeError("it did not happen in time")
        time.sleep(0.002)
    return time.monotonic() - begun


def named_s(output: Path, name: str) -> float:
    """Return the seconds from a strange node's first received message until a finding names it."""
    # After ROS's variables are set.
    from tfcompose.tf.ros.node import TFPublisher, open_node  # noqa: PLC0415
    from tfcompose.tf.ros.tf_codec import SentTransform, encode  # noqa: PLC0415 (the same)

    with open_node(name, "/bench") as node:
        publisher = TFPublisher(node, static=False)
        seconds_until(lambda: publisher.publisher.get_subscription_count() > 0)

        def is_named() -> bool:
            transform = SentTransform(
                time.time_ns(), "odom", "base_link", (1.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)
            )
            publisher.publish(encode([transform]))
            return f"/bench/{name}" in output.read_text("utf-8")

        return seconds_until(is_named)


def silent_s(launcher: psutil.Process, output: Path) -> float:
    """Return the seconds from an owner's standstill until a finding says that it fell silent."""
    (drive,) = [process for process in launcher.children() if "drive" in process.cmdline()[-1:]]
    before = output.read_text("utf-8").count("fell silent")
    drive.suspend()
    try:
        return seconds_until(lambda: output.read_text("utf-8").count("fell silent") > before)
    finally:
        drive.resume()
        seconds_until(lambda: output.read_text("utf-8").count("is back after") > before)


def ended_s(launcher: psutil.Process) -> float:
    """Return the seconds from the launcher's SIGKILL until all its processes have ended."""
    below = launcher.children(recursive=True)
    launcher.kill()
    return seconds_until(
        lambda: not any(each.is_running() and each.status() != "zombie" for each in below)
    )


BENCHMARK = Benchmark(
    name="reactions",
    about="a robot with an owner at 50 Hz runs under `up`",
    rows={
        "named": Row("a node that publishes another's edge is reported after", "s", (Limit(1.0),)),
        "silent": Row("an owner that fell silent is reported after", "s", (Limit(1.0),)),
        "ended": Row(
            "all processes of a launcher that was killed have ended after", "s", (Limit(2.0),)
        ),
    },
    contenders={TFCOMPOSE_ON_ROS: robot},
    runs=5,
)
