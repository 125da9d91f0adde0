"""A strict guard next to a node that sends 10,000 new frames at 20 Hz, beside a watching one.

Delays are from stamp to arrival in the listener's DDS, so that they hold nothing of its Python.
"""

from __future__ import annotations

import sys
import time
from contextlib import contextmanager
from itertools import pairwise
from statistics import quantiles
from typing import TYPE_CHECKING

import psutil

from tests.benchmarks.benchmark import Benchmark, Contender, Opened, Row
from tests.benchmarks.contenders import TFCOMPOSE_ON_ROS
from tests.benchmarks.fixed_robot import PROGRAMS
from tests.benchmarks.measures import cpu_s, pss_mb
from tests.support.adversary import Child, flood, running

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from tests.benchmarks.benchmark import Sampler, Workspace

EDGES, RATE, FRAMES = 50, 50, 10_000
ROUND_S, WARM_UP_S, SETTLE_S = 10.0, 2.0, 3.0
CALM, WATCH, REMAP = (
    Contender("strict without a flood"),
    Contender("`mode: watch`"),
    Contender("`fence: remap`"),
)


def opened(guard: str, *, is_flooded: bool) -> Opened:
    """Return the function that opens a way of guarding; its robot is started in each round."""

    @contextmanager
    def robots(workspace: Workspace) -> Iterator[Sampler]:
        numbers = iter(range(sys.maxsize))

        def sample() -> Mapping[str, float]:
            folder = workspace.folder / str(next(numbers))
            folder.mkdir()
            command = [sys.executable, str(PROGRAMS / "owner.py"), "base_link"]
            owner = Child([*command, str(EDGES), str(RATE)], [f"frame_{n}" for n in range(EDGES)])
            with running(folder, guard, {"owner": owner}) as robot:
                robot.says("tree complete")
                guarding = [psutil.Process(robot.pid_of("guard"))]
                if is_flooded:
                    flooding = robot.start([sys.executable, "-c", flood(FRAMES)])
                time.sleep(SETTLE_S)
                used, began = cpu_s(guarding), time.monotonic()
                delays_ms, arrivals_ns = _received()
                core = 100 * (cpu_s(guarding) - used) / (time.monotonic() - began)
                memory = pss_mb(guarding)
                if is_flooded:
                    robot.says("TF853", "/flood")
                    robot.stop(flooding)
            gap_ns = max(after - before for before, after in pairwise(arrivals_ns))
            return {
                "p99": quantiles(delays_ms, n=100)[98],
                "gap": gap_ns / 1e6,
                "core": core,
                "memory": memory,
            }

        yield sample

    return robots


def _received() -> tuple[list[float], list[int]]:
    """Return delays of the owner's messages in milliseconds, and times of arrival in ns."""
    # After ROS's variables are set.
    from tfcompose.foundation.signals import Stop  # noqa: PLC0415
    from tfcompose.tf.ros.node import TFSubscription, open_node, wait  # noqa: PLC0415 (the same)
    from tfcompose.tf.ros.tf_codec import decode  # noqa: PLC0415 (the same)

    delays_ms: list[float] = []
    arrivals_ns: list[int] = []
    with open_node("listener", "/bench") as node:
        subscription, begun = TFSubscription(node, static=False), time.monotonic() + WARM_UP_S
        while time.monotonic() < begun + ROUND_S:
            wait(node, [subscription], 0.2, Stop())
            for message in subscription.take():
                # Some messages are sent again for a listener that joins.
                if time.monotonic() < begun:
                    continue
                if len(message.data) < EDGES * 200 and b"frame_0\0" in message.data:
                    arrivals_ns.append(message.received_ns)
                    stamp_ns = decode(message.data)[0].stamp_ns
                    delays_ms.append((message.received_ns - stamp_ns) / 1e6)
    return delays_ms, arrivals_ns


BENCHMARK = Benchmark(
    name="flood",
    about=f"{EDGES} edges at {RATE} Hz next to a node that sends 10,000 new frames at 20 Hz",
    rows={
        "p99": Row("beside a flood, a strict guard's edges arrive after, 99th percentile", "ms"),
        "gap": Row("… longest gap", "ms"),
        "core": Row("… the guard", "% of a core"),
        "memory": Row("… the guard's memory", "MB"),
    },
    contenders={
        TFCOMPOSE_ON_ROS: opened("strict", is_flooded=True),
        REMAP: opened("remap", is_flooded=True),
        WATCH: opened("watch", is_flooded=True),
        CALM: opened("strict", is_flooded=False),
    },
    runs=5,
    quick_runs=1,
    timeout_s=1800.0,
)
