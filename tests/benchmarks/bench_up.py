"""How soon ``up`` has a tree, and what it takes.

``python -m tests.benchmarks.bench_up``, or name the file to pytest.

A robot with 100 fixed edges. Beside it a plain rclpy process that sends the same edges, started in
turn with it, so that a busy moment meets both; both are measured from the start of their program
to the moment when a listener that was there before has all edges. That one announces itself often,
as tfcompose's own do: how long a newcomer takes to find a stock one, 0.1 or 3 s, is chance, and
the same for both. A stock listener that joins later is measured from ``rclpy.init`` on. Medians.
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

from tests.benchmarks.results import record
from tfcompose.tf.ros.environment import FASTDDS_PROFILE, PROFILE_VARIABLES

if TYPE_CHECKING:
    from collections.abc import Iterator

EDGES = 100
RUNS = 10
JOINERS = 20
DRY_RUNS = 7
#: At most: later than the plain process; for a listener that joins; for all processes; for a dry
#: run.
LATER_S, JOINED_S, MEMORY_MB, DRY_RUN_S = 1.0, 0.6, 110.0, 0.15
DOMAIN = "99"
#: A stock listener: says how long after rclpy.init, and when on the machine's clock, it had all
#: edges.
LISTENER = f"""
import time
import rclpy
from rclpy.qos import DurabilityPolicy, QoSProfile
from tfcompose.tf.ros.tf_codec import decode
from tfcompose.tf.ros.typesupport import tf_message_type
began = time.monotonic()
rclpy.init()
node, seen = rclpy.create_node("listener"), set()
take = lambda data: seen.update(one.child for one in decode(data))
qos = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
node.create_subscription(tf_message_type(), "/tf_static", take, qos, raw=True)
print("listens", flush=True)
while len(seen) < {EDGES}:
    rclpy.spin_once(node, timeout_sec=10)
print(time.monotonic() - began, time.monotonic(), flush=True)
node.destroy_node()
rclpy.shutdown()
"""
#: A plain rclpy process that sends all edges once, and stays.
PLAIN = f"""
import rclpy
from rclpy.qos import DurabilityPolicy, QoSProfile
from tfcompose.tf.ros.tf_codec import Template
from tfcompose.tf.ros.typesupport import tf_message_type
rclpy.init()
node = rclpy.create_node("plain")
qos = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
publisher = node.create_publisher(tf_message_type(), "/tf_static", qos)
publisher.publish(Template([("base_link", f"frame_{{n}}") for n in range({EDGES})]).data)
rclpy.spin(node)
"""


def built(folder: Path) -> Path:
    """Build the robot, and return its plan's file."""
    frames = "\n".join(
        f"  frame_{n}: {{parent: base_link, xyz: [{n / 10:g}, 0, 0]}}" for n in range(EDGES)
    )
    (folder / "robot.yaml").write_text(
        f"tfcompose: 1\nrobot: bench\nframes:\n  base_link: {{}}\n{frames}\n"
    )
    words = ("tfcompose", "build", "robot.yaml", "-o", "built")
    subprocess.run(
        [sys.executable, "-m", *words], check=True, cwd=folder, stdout=subprocess.DEVNULL
    )
    return folder / "built" / "plan.json"


@contextmanager
def running(folder: Path, *words: str) -> Iterator[subprocess.Popen[bytes]]:
    """Run a Python program until the block ends; Ctrl-C ends it then."""
    popen = subprocess.Popen(
        [sys.executable, *words], cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    try:
        yield popen
    finally:
        popen.send_signal(signal.SIGINT)
        popen.wait(20)


@contextmanager
def listening(**environment: str) -> Iterator[subprocess.Popen[str]]:
    env = os.environ | environment
    popen = subprocess.Popen(
        [sys.executable, "-c", LISTENER], stdout=subprocess.PIPE, text=True, env=env
    )
    try:
        assert popen.stdout
        assert popen.stdout.readline() == "listens\n"
        yield popen
        popen.wait(20)  # one that is killed stays in the others' lists, and delays them
    finally:
        popen.kill()
        popen.wait()


def heard(popen: subprocess.Popen[str]) -> tuple[float, float]:
    """Return when the listener had all edges.

    In seconds since rclpy.init, and as a moment on the machine's clock.
    """
    assert popen.stdout
    since_init, at = popen.stdout.readline().split()
    return float(since_init), float(at)


def until_live(folder: Path, *words: str) -> float:
    """Return the seconds from the program's start until an earlier listener has all edges."""
    with listening(**{PROFILE_VARIABLES[0]: str(FASTDDS_PROFILE)}) as listener:
        began = time.monotonic()
        with running(folder, *words):
            return heard(listener)[1] - began


def joined() -> float:
    """Return the seconds from rclpy.init until a listener that joins has all edges."""
    with listening() as listener:
        return heard(listener)[0]


def memory_mb(pid: int) -> dict[str, float]:
    """Return the proportional memory of the launcher and its processes, by what they are."""
    found = {}
    for process in (one := psutil.Process(pid), *one.children(recursive=True)):
        words = process.cmdline()
        name = next((word for word in words if word.startswith("tfcompose")), words[0])
        found[f"{name} {process.pid}"] = process.memory_full_info().pss / 1e6
    return found


def dry_run_s(folder: Path, plan: Path) -> float:
    """Return the median seconds of a dry run of the built plan."""
    seconds = []
    for _ in range(DRY_RUNS):
        began = time.monotonic()
        words = ("-m", "tfcompose", "up", str(plan), "--dry-run")
        subprocess.run([sys.executable, *words], check=True, cwd=folder, stdout=subprocess.DEVNULL)
        seconds.append(time.monotonic() - began)
    return median(seconds)


def measure(runs: int = RUNS, joiners: int = JOINERS) -> dict[str, list[float]]:
    """Return the seconds of each run, and the memory of each process."""
    found: dict[str, list[float]] = {
        name: [] for name in ("plain", "up", "joined", "memory", "dry run")
    }
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "runtime").mkdir(mode=0o700)
        places = {"XDG_RUNTIME_DIR": f"{name}/runtime", "ROS_LOG_DIR": f"{name}/log"}
        os.environ |= {
            "ROS_DOMAIN_ID": DOMAIN,
            "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        } | places
        plan = built(folder)
        up = ("-m", "tfcompose", "up", str(plan))
        for _ in range(runs):
            found["plain"].append(until_live(folder, "-c", PLAIN))
            found["up"].append(until_live(folder, *up))
        with running(folder, *up) as launcher:
            joined()
            found["joined"] = [joined() for _ in range(joiners)]
            found["memory"] = list(memory_mb(launcher.pid).values())
        found["dry run"] = [dry_run_s(folder, plan)]
    return found


@pytest.mark.ros
def test_100_edges_are_live_soon_and_at_once_for_who_joins_in_little_memory() -> None:
    found = measure()
    assert median(found["up"]) - median(found["plain"]) <= LATER_S, found
    assert max(found["joined"]) <= JOINED_S, found
    assert sum(found["memory"]) <= MEMORY_MB, found
    assert found["dry run"][0] <= DRY_RUN_S, found


if __name__ == "__main__":
    before = os.getloadavg()[0]
    observed = measure(*(int(word) for word in sys.argv[1:] if word.isdecimal()))
    plain, ours = median(observed["plain"]), median(observed["up"])
    sys.stdout.write(
        f"{EDGES} edges at a listener: plain {plain:.2f} s, up {ours:.2f} s ({ours - plain:+.2f}"
        " s)\n"
    )
    sys.stdout.write(f"  plain {sorted(round(one, 2) for one in observed['plain'])}\n")
    sys.stdout.write(f"  up    {sorted(round(one, 2) for one in observed['up'])}\n")
    late = sum(one > JOINED_S for one in observed["joined"])
    sys.stdout.write(
        f"who joins: median {median(observed['joined']):.2f} s, longest"
        f" {max(observed['joined']):.2f} s, "
    )
    sys.stdout.write(f"{late} of {len(observed['joined'])} over {JOINED_S} s\n")
    sys.stdout.write(
        f"memory: {sum(observed['memory']):.0f} MB: {[round(one) for one in observed['memory']]}\n"
    )
    sys.stdout.write(f"dry run: {observed['dry run'][0]:.3f} s\n")
    joiners = f"{median(observed['joined']):.2f} s, at most {max(observed['joined']):.2f} s"
    rows = {
        f"{EDGES} fixed edges are at a listener after": [
            f"{ours:.2f} s",
            f"{plain:.2f} s: a plain rclpy process",
        ],
        "a listener that joins has all edges after": [
            f"{joiners} in {len(observed['joined'])} tries",
            "",
        ],
        "memory, shared pages divided": [f"{sum(observed['memory']):.0f} MB", ""],
    }
    record("up", rows, before)
