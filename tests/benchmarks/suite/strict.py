"""Delay of a strict guard, beside the same robot whose guard only watches."""

from __future__ import annotations

import sys
import time
from contextlib import contextmanager
from statistics import median, quantiles
from typing import TYPE_CHECKING

from tests.benchmarks.benchmark import Benchmark, Contender, Limit, Opened, Row
from tests.benchmarks.contenders import TFCOMPOSE_ON_ROS
from tests.benchmarks.fixed_robot import PROGRAMS

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from tests.benchmarks.benchmark import Sampler, Workspace

EDGES, RATE = 50, 200
ROUND_S, WARM_UP_S, TIMEOUT_S = 2.5, 1.0, 30.0
WATCH, REMAP = Contender("`mode: watch`"), Contender("`fence: remap`")
GUARDS = {
    TFCOMPOSE_ON_ROS: "mode: strict, fence: partition",
    REMAP: "mode: strict, fence: remap",
    WATCH: "mode: watch",
}


def opened(guard: str) -> Opened:
    """Return the function that opens a way of guarding; its robot is started in each round."""

    @contextmanager
    def robot(workspace: Workspace) -> Iterator[Sampler]:
        owner = f"{{run: [{sys.executable}, {PROGRAMS / 'owner.py'}, base, '{EDGES}', '{RATE}']"
        keys = f"{{parent: base, owner: owner, rate: {RATE} Hz}}"
        lines = [
            "tfcompose: 1\nrobot: bench\nros: {discovery: localhost}\nbase: base",
            f"guard: {{{guard}}}\nprocesses:\n  owner: {owner}, node: /owner}}",
            "frames:\n  base: {}",
            *(f"  frame_{n}: {keys}" for n in range(EDGES)),
        ]
        (workspace.folder / "robot.yaml").write_text("\n".join(lines) + "\n", encoding="utf-8")
        up = (sys.executable, "-m", "tfcompose", "up")

        def sample() -> Mapping[str, float]:
            with workspace.running(*up), workspace.entered():
                delays = _delays_ms()
            if len(delays) < 0.8 * ROUND_S * RATE:
                raise RuntimeError(f"{len(delays)} messages came")
            return {"median": median(delays), "p99": quantiles(delays, n=100)[98]}

        yield sample

    return robot


def _delays_ms() -> list[float]:
    """Return the times from stamp to receipt of a round's messages, in milliseconds."""
    # After ROS's variables are set.
    from tfcompose.foundation.signals import Stop  # noqa: PLC0415
    from tfcompose.tf.ros.node import TFSubscription, open_node, wait  # noqa: PLC0415 (the same)
    from tfcompose.tf.ros.tf_codec import decode  # noqa: PLC0415 (the same)

    delays: list[float] = []
    with open_node("listener", "/bench") as node:
        subscription, begun, stop = TFSubscription(node, static=False), 0.0, Stop()
        end = time.monotonic() + TIMEOUT_S
        while time.monotonic() < end:
            wait(node, [subscription], 0.5, stop)
            now_ns = time.time_ns()
            for message in subscription.take():
                transforms = decode(message.data)
                if len(transforms) != EDGES:
                    continue
                if not begun:
                    begun = time.monotonic()
                    end = begun + WARM_UP_S + ROUND_S
                if time.monotonic() > begun + WARM_UP_S:
                    delays.append((now_ns - transforms[0].stamp_ns) / 1e6)
    return delays


BENCHMARK = Benchmark(
    name="strict",
    about=f"a process sends {EDGES} edges at {RATE} Hz; from stamp to a listener",
    rows={
        "median": Row(
            "edges reach a listener behind a strict guard after, median",
            "ms",
            (Limit(0.4, "least", above=WATCH),),
        ),
        "p99": Row("… 99th percentile", "ms"),
    },
    contenders={contender: opened(guard) for contender, guard in GUARDS.items()},
    runs=5,
)
