"""``tfcompose echo`` on the real thing."""

import json
import math
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest
from builtin_interfaces.msg import Time
from rosgraph_msgs.msg import Clock

from tests.support import processes
from tests.support.processes import Started
from tests.support.waiting import until
from tfcompose.foundation.geometry import Pose, quat_from_rpy
from tfcompose.foundation.signals import Stop
from tfcompose.model.plan import PlanEdge, PlanProcess, Simulation
from tfcompose.tf.live.echo import echo as run_echo
from tfcompose.tf.live.pose_query import PoseQuery
from tfcompose.tf.ros.clock import SimClock
from tfcompose.tf.ros.node import TFPublisher, open_node
from tfcompose.tf.ros.tf_codec import SentTransform, encode

pytestmark = pytest.mark.ros

#: So long echo waits for a pose that does not come, again and again: where much else runs,
#: publishers are found late.
TIMEOUTS_S = (2.0, 6.0, 20.0)
DOWN_15 = Pose((0.2, 0.0, 0.1), quat_from_rpy(0, math.radians(15), 0))


@pytest.fixture
def rover(
    write: Callable[..., Path], start: Callable[..., Started], edge: Callable[..., PlanEdge]
) -> None:
    """A base at x = 2 in odom, a camera that looks down 15 degrees, and a separate tree."""
    edges = [
        edge("odom base_link", "drive"),
        edge("base_link camera", pose=DOWN_15),
        edge("world table"),
    ]
    drive = PlanProcess(
        "drive", "simulate", simulate=Simulation("fixed", 50.0, pose=Pose((2.0, 0.0, 0.0)))
    )
    plan = write(edges, PlanProcess("static", "static"), drive)
    for module, name in (("static", "static"), ("simulate", "drive")):
        started = start(module, plan, name)
        started.until_says("edge")


def echo(*arguments: str, timeout: float = 60.0) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "tfcompose", "echo", *arguments, "--timeout", str(timeout)]
    return processes.run(command)


def misses(*arguments: str, why: str) -> subprocess.CompletedProcess[str]:
    """Let echo wait, longer and longer, until it misses the pose for this reason."""
    for timeout in TIMEOUTS_S:
        done = echo(*arguments, timeout=timeout)
        if why in done.stderr:
            break
    assert why in done.stderr
    assert done.returncode == 1
    return done


@pytest.mark.usefixtures("rover")
def test_json_is_one_object_a_line_until_a_signal_ends_it_with_exit_code_0() -> None:
    command = [
        sys.executable,
        "-m",
        "tfcompose",
        "echo",
        "odom",
        "camera",
        "--rate",
        "20",
        "--timeout",
        "60",
    ]
    command += ["--format", "json"]
    with processes.start(command, stdout=subprocess.PIPE) as process:
        assert process.stdout
        rows = [json.loads(process.stdout.readline()) for _ in range(3)]
        process.send_signal(signal.SIGINT)
        assert process.wait(60) == 0
    for row in rows:
        assert (row["parent"], row["child"]) == ("odom", "camera")
        assert row["xyz"] == pytest.approx([2.2, 0, 0.1])
        assert row["quat_xyzw"] == pytest.approx(DOWN_15.quat_xyzw)
        assert row["rpy"] == pytest.approx([0, math.radians(15), 0])
    stamps = [row["stamp_ns"] for row in rows]
    assert stamps == sorted(set(stamps)), "each line has a newer time"


@pytest.mark.usefixtures("rover")
@pytest.mark.parametrize(
    ("a", "b", "why"),
    [
        ("odom", "camra", "camera?"),
        ("odom", "table", "two trees"),
    ],
)
def test_a_miss_says_why_and_ends_with_exit_code_1(a: str, b: str, why: str) -> None:
    done = misses(a, b, why=why)
    assert done.stdout == ""
    assert "error[TF814]" in done.stderr


def test_when_the_owner_falls_silent_it_says_so_and_ends(
    write: Callable[..., Path], start: Callable[..., Started], edge: Callable[..., PlanEdge]
) -> None:
    drive = PlanProcess("drive", "simulate", simulate=Simulation("fixed", 50.0))
    plan = write([edge("odom base_link", "drive")], drive)
    command = [
        sys.executable,
        "-m",
        "tfcompose",
        "echo",
        "odom",
        "base_link",
        "--rate",
        "20",
        "--timeout",
    ]
    for timeout in TIMEOUTS_S:
        owner = start("simulate", plan, "drive")
        owner.until_says("edge")
        words = [*command, str(timeout)]
        with processes.start(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
            assert process.stdout
            first = process.stdout.readline()
            owner.end()
            _, errors = process.communicate(timeout=90)
        assert process.returncode == 1
        if first:  # or it was not found in time
            break
    assert first.startswith("pose of base_link in odom")
    silent = re.search(r" odom → base_link for (\d+\.\d) s", errors)
    assert silent, errors
    assert float(silent[1]) >= timeout


class Talker:
    """Sends TF from the test: latched what is fixed, again and again what moves."""

    def __init__(self, node: Any, namespace: str = "") -> None:
        self._publishers = [
            TFPublisher(node, static=static, topic=f"{namespace}{topic}")
            for static, topic in ((False, "/tf"), (True, "/tf_static"))
        ]

    def say(self, parent: str, child: str, x: float, stamp_ns: int = 0, w: float = 1.0) -> None:
        data = encode([SentTransform(stamp_ns, parent, child, (x, 0.0, 0.0), (0.0, 0.0, 0.0, w))])
        self._publishers[stamp_ns == 0].publish(data)

    def is_heard(self) -> bool:
        return all(each.publisher.get_subscription_count() for each in self._publishers)

    def until_heard(self, by: subprocess.Popen[str]) -> None:
        assert until(lambda: self.is_heard() or by.poll() is not None)


@pytest.fixture
def running(domain: Any) -> Iterator[Callable[..., subprocess.Popen[str]]]:
    """Start ``tfcompose echo`` and do not wait."""
    started: list[subprocess.Popen[str]] = []

    def run(*arguments: str) -> subprocess.Popen[str]:
        command = [sys.executable, "-m", "tfcompose", "echo", *arguments]
        process = processes.start(
            command, env=domain.environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE
        )
        started.append(process)
        return started[-1]

    yield run
    for process in started:
        process.kill()
        process.communicate()


def test_the_pose_at_a_time_is_interpolated_with_the_requested_decimals(
    running: Callable[..., subprocess.Popen[str]],
) -> None:
    words = ["--at", "101.25", "--precision", "2", "--timeout", "60"]
    with open_node("talks", "") as node:
        talker = Talker(node)
        process = running("odom", "/base_link", *words)
        talker.until_heard(process)
        for second in range(4):
            talker.say("odom", "base_link", float(second), (100 + second) * 10**9)
        output, errors = process.communicate(timeout=90)
    assert (process.returncode, errors) == (0, "")
    lines = output.splitlines()
    assert "at 101.250000000" in lines[0]
    assert lines[1:3] == [
        "  xyz        [1.25, 0.00, 0.00] m",
        "  quat_xyzw  [0.00, 0.00, 0.00, 1.00]",
    ]
    assert lines[4] == "             [0, 0, 0] deg"


@pytest.fixture
def messages_of(running: Callable[..., subprocess.Popen[str]]) -> Callable[..., str]:
    """Let echo hear (x, stamp in seconds, w of the quaternion) of base_link in odom.

    Return why it ends.
    """

    def run(samples: Sequence[tuple[float, int, float]], why: str, *arguments: str) -> str:
        with open_node("talks", "") as node:
            talker = Talker(node)
            for timeout in TIMEOUTS_S:
                assert until(lambda: not talker.is_heard()), "the one before has left"
                process = running("odom", "base_link", *arguments, "--timeout", str(timeout))
                talker.until_heard(process)
                for x, second, w in samples:
                    talker.say("odom", "base_link", x, second * 10**9, w)
                _, errors = process.communicate(timeout=90)
                assert process.returncode == 1
                if why in errors:
                    break
        return errors

    return run


def test_under_a_namespace_only_its_topics_are_heard(
    running: Callable[..., subprocess.Popen[str]],
) -> None:
    with open_node("talks", "") as node:
        ours, foreign = Talker(node, "/robot1"), Talker(node)
        foreign.say("odom", "base_link", 9.0)
        ours.say("odom", "base_link", 1.0)
        words = ["--namespace", "robot1", "--format", "json", "--timeout", "60"]
        process = running("odom", "base_link", "--once", *words)
        output, errors = process.communicate(timeout=90)
    assert (process.returncode, errors) == (0, "")
    row = json.loads(output)
    assert (row["xyz"], row["stamp_ns"]) == ([1.0, 0.0, 0.0], None)


@pytest.mark.parametrize(
    ("samples", "why", "words"),
    [
        pytest.param(
            [(1.0, 100, 1.0), (1.0, 1, 1.0)],
            "base_link was too old",
            ["--rate", "100"],
            id="the time starts again",
        ),
        pytest.param([(0.0, 1, 1.1)], "base_link was rejected", [], id="tf2 refuses it"),
    ],
)
def test_why_no_pose_comes_is_reported(
    messages_of: Callable[..., str],
    samples: list[tuple[float, int, float]],
    why: str,
    words: list[str],
) -> None:
    assert why in messages_of(samples, why, *words)


@pytest.mark.usefixtures("domain")
def test_a_restart_of_simulated_time_discards_earlier_transforms(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A bag that is played with its clock, again and again.

    A transform of the old time comes with the new time, between two looks of echo's.
    """
    poses: list[float] = []
    second, now_ns, stop = [100], SimClock.now_ns, Stop()
    query = PoseQuery(
        "odom", "base_link", once=False, rate=100.0, timeout_s=60.0, topics=("/tf", "/tf_static")
    )

    def say(pose: Pose, _: int | None) -> None:
        poses.append(pose.xyz[0])
        if pose.xyz[0] < 100:
            stop.request()

    with open_node("talks", "") as node:
        talker, publisher = Talker(node), node.create_publisher(Clock, "/clock", 1)

        def late(clock: SimClock) -> int | None:
            if poses and second == [100]:
                talker.say("odom", "base_link", 101.0, 101 * 10**9)
                second[:] = [7]

            def comes() -> bool:
                publisher.publish(Clock(clock=Time(sec=second[0])))
                return now_ns(clock) == second[0] * 10**9

            assert until(comes)
            talker.say("odom", "base_link", float(second[0]), second[0] * 10**9)
            return now_ns(clock)

        monkeypatch.setattr(SimClock, "now_ns", late)
        assert run_echo(query, say, stop) is None
    assert (poses[0], poses[-1]) == (100.0, 7.0)
    assert 101.0 not in poses
