"""What liars can do to a robot.

``python tests/benchmarks/bench_adversary.py [accusations [TRIES] | flood]``.

``accusations`` starts strange publishers, of all kinds in turn, beside a robot that each way of
guarding watches, and counts who was named: with its process, without, somebody else, nobody in
time. ``flood`` measures a plan of 50 edges at 50 Hz beside a node that sends 10,000 new frames at
20 Hz: how late strict's owned edges come at a listener, and what the guard takes. Delays are from
stamp to arrival in the listener's DDS, so that they hold nothing of its Python.
"""

from __future__ import annotations

import re
import sys
import tempfile
import time
from collections import Counter
from itertools import cycle, islice, pairwise
from pathlib import Path
from statistics import median, quantiles
from typing import TYPE_CHECKING

import psutil

from tests.support.adversary import GUARDS, OTHER_X, Child, Robot, flood, foreign, node, running
from tests.support.waiting import complete_lines, until
from tfcompose.foundation.signals import Stop
from tfcompose.tf.ros.node import TFSubscription, open_node, wait
from tfcompose.tf.ros.tf_codec import decode

if TYPE_CHECKING:
    from collections.abc import Sequence

#: Kinds of strangers: their command, and what they are called in findings; one that is no ROS node
#: has no process.
KINDS = {
    "a stranger": (node("stranger", OTHER_X, "map odom"), "/stranger"),
    "the owner's name": (node("slam", OTHER_X, "map odom"), "another /slam"),
    "the other owner's name": (node("drive", OTHER_X, "map odom"), "/drive"),
    "the owner's name below it": (
        node("slam", OTHER_X, "map odom", namespace="/slam"),
        "/slam/slam",
    ),
    "the guard's name": (node("tfcompose_guard", OTHER_X, "map odom"), "/tfcompose_guard"),
    "an undeclared edge": (node("slam", OTHER_X, "odom extra"), "/slam"),
    "another parent": (node("stranger", OTHER_X, "odom map"), "/stranger"),
    "another vendor's DDS": (foreign(OTHER_X, "map odom"), "a DDS program that is no ROS node"),
}
TRIES, REPORTED_WITHIN_S = 200, 20.0


def accusations(tries: int) -> dict[str, Counter[str]]:
    """Return for each way of guarding how often who was named, of so many tries in all."""
    found = {}
    for guard in GUARDS:
        with tempfile.TemporaryDirectory() as folder, running(Path(folder), guard, {}) as robot:
            robot.says("tree complete")
            found[guard] = Counter(
                _tried(robot, kind) for kind in islice(cycle(KINDS), -(-tries // len(GUARDS)))
            )
            sys.stdout.write(f"{guard}: {dict(found[guard])}\n")
            sys.stdout.flush()
    return found


def _tried(robot: Robot, kind: str) -> str:
    """Start one of that kind, and return who was named."""
    command, name = KINDS[kind]
    after = len(robot.lines())
    one = robot.start(command)

    def text() -> str:
        return "\n".join(complete_lines(robot.output)[after:])

    def reported() -> bool:
        return bool(re.search(r"\[TF8\d\d\]", text())) and (
            "no ROS node" in text() or "runs on this" in text()
        )

    named = until(reported, REPORTED_WITHIN_S)
    time.sleep(1.0)  # somebody else may be accused with it
    robot.stop(one)
    pids = {int(pid) for pid in re.findall(r"runs on this machine as pid (\d+)", text())}
    over = until(lambda: " over" in text(), REPORTED_WITHIN_S)
    result = "named" if name in text() else "wrong name" if named else "nobody"
    if pids - {one.pid}:
        result = "somebody else"
    if result != "named" or not over:
        sys.stdout.write(
            f"{robot.guard}, {kind}: {result}, {'over' if over else 'not over'}\n{text()}\n"
        )
    return result


EDGES, HERTZ, FRAMES = 50, 50.0, 10_000
ROUND_S, BEFORE_S = 20.0, 2.0
OWNER = Path(__file__).with_name("owner.py")


def floods(guard: str, *, flooded: bool) -> tuple[list[float], float, float, float]:
    """Return delays in milliseconds, the longest gap, and the guard's memory and CPU share.

    The gap is in seconds, the memory in MB, the share a part of one core.
    """
    frames = [f"frame_{n}" for n in range(EDGES)]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        owner = Child([sys.executable, str(OWNER), "base_link", str(EDGES), f"{HERTZ:g}"], frames)
        with running(folder, guard, {"owner": owner}) as robot:
            robot.says("tree complete")
            guarding = psutil.Process(robot.pid_of("guard"))
            other = robot.start([sys.executable, "-c", flood(FRAMES)]) if flooded else None
            time.sleep(3.0)
            before, begun = sum(guarding.cpu_times()[:2]), time.monotonic()
            delays, arrivals = _heard()
            part = (sum(guarding.cpu_times()[:2]) - before) / (time.monotonic() - begun)
            memory = guarding.memory_info().rss / 1e6
            if other:
                robot.says("TF853", "/flood")
                robot.stop(other)
    gaps = [after - before for before, after in pairwise(arrivals)]
    return delays, max(gaps) / 1e9, memory, part


def _heard() -> tuple[list[float], list[int]]:
    delays: list[float] = []
    arrivals: list[int] = []
    with open_node("listener", "/bench") as own:
        reader, begun = TFSubscription(own, static=False), time.monotonic() + BEFORE_S
        while time.monotonic() < begun + ROUND_S:
            wait(own, [reader], 0.2, Stop())
            for one in reader.take():
                if time.monotonic() < begun:  # it joins, and some messages are sent again for it
                    continue
                if len(one.data) < EDGES * 200 and b"frame_0\0" in one.data:
                    arrivals.append(one.received_ns)
                    delays.append((one.received_ns - decode(one.data)[0].stamp_ns) / 1e6)
    return delays, arrivals


def main(words: Sequence[str]) -> None:
    """Measure what the words say, and print it."""
    if "flood" not in words:
        numbers = [int(word) for word in words if word.isdigit()]
        found = sum(accusations(numbers[0] if numbers else TRIES).values(), Counter[str]())
        sys.stdout.write(f"{sum(found.values())} tries: {dict(found)}\n")
    if "accusations" not in words:
        p99 = {}
        for guard in ("watch", "strict", "remap"):
            for flooded in (False, True):
                delays, gap, memory, part = floods(guard, flooded=flooded)
                p99[guard, flooded] = quantiles(delays, n=100)[98]
                sys.stdout.write(
                    f"{guard}{' beside a flood' if flooded else ''}: median {median(delays):.2f}"
                    f" ms, 99th percentile {p99[guard, flooded]:.2f} ms, longest gap {gap:.3f} s,"
                    f" {len(delays)} of {ROUND_S * HERTZ:.0f}; guard {memory:.0f} MB,"
                    f" {100 * part:.0f} % of a core\n"
                )
                sys.stdout.flush()
        for guard in ("strict", "remap"):
            added = p99[guard, True] - p99["watch", True]
            sys.stdout.write(
                f"{guard} adds {added:.2f} ms at the 99th percentile beside a flood\n"
            )


if __name__ == "__main__":
    main(sys.argv[1:])
