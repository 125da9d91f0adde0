"""``tfcompose echo`` on the real thing."""

from __future__ import annotations

import json
import math
import signal
import subprocess
import sys
import threading
from typing import TYPE_CHECKING, Any

import pytest
from builtin_interfaces.msg import Time
from rosgraph_msgs.msg import Clock

from tfcompose.plan import PlanProcess, Simulation
from tfcompose.pose import Pose, quat_from_rpy
from tfcompose.ros.message import Transform, encode
from tfcompose.ros.node import open_node
from tfcompose.ros.tf import TFPublisher

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path
    from typing import Protocol

    from tfcompose.plan import PlanEdge

    class Started(Protocol):
        """A process under test, as conftest starts it."""

        def until_says(self, text: str) -> None: ...
        def end(self) -> tuple[int, float]: ...


pytestmark = pytest.mark.ros

DOWN_15 = Pose((0.2, 0.0, 0.1), quat_from_rpy(0, math.radians(15), 0))


@pytest.fixture
def rover(write: Callable[..., Path], start: Callable[..., Started], edge: Callable[..., PlanEdge]) -> None:
    """A base that stands at x = 2 in odom, with a camera that looks down 15 degrees, and a tree of its own beside."""
    edges = [edge("odom base_link", "drive"), edge("base_link camera", pose=DOWN_15), edge("world table")]
    drive = PlanProcess("drive", "simulate", simulate=Simulation("fixed", 50.0, pose=Pose((2.0, 0.0, 0.0))))
    plan = write(edges, PlanProcess("static", "static"), drive)
    for module, name in (("static", "static"), ("simulate", "drive")):
        started = start(f"tfcompose.run.{module}", plan, name)
        started.until_says("edge")


def echo(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "tfcompose", "echo", *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=30, check=False)


@pytest.mark.usefixtures("rover")
def test_a_time_before_it_listened_is_looked_for_in_recordings() -> None:
    done = echo("odom", "camera", "--at", "1000000000.5", "--timeout", "3")
    assert done.returncode == 1
    assert "would be extrapolation into the past" in done.stderr
    assert "look into a recording: --bag" in done.stderr


@pytest.mark.usefixtures("rover")
def test_names_are_tf2s_without_a_slash_before_them() -> None:
    pose = json.loads(echo("/odom", "/camera", "--once", "--format", "json").stdout)
    assert (pose["parent"], pose["child"]) == ("odom", "camera")


@pytest.mark.usefixtures("rover")
def test_once_prints_the_pose_in_metres_quaternion_radians_and_degrees() -> None:
    done = echo("odom", "camera", "--once")
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("pose of camera in odom at ")
    assert "xyz        [2.2000, 0.0000, 0.1000] m" in done.stdout
    assert "rpy        [0.0000, 0.2618, 0.0000] rad" in done.stdout
    assert "[0.00, 15.00, 0.00] deg" in done.stdout


@pytest.mark.usefixtures("rover")
def test_json_is_one_object_a_line_until_a_signal_ends_it_with_exit_code_0() -> None:
    command = [sys.executable, "-m", "tfcompose", "echo", "odom", "camera", "--rate", "20", "--format", "json"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout
        rows = [json.loads(process.stdout.readline()) for _ in range(3)]
        process.send_signal(signal.SIGINT)
        assert process.wait(10) == 0
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
        ("odom", "camra", "no frame camra; did you mean camera?"),
        ("odom", "table", "odom and table are in two trees"),
    ],
)
def test_a_miss_says_why_and_ends_with_exit_code_1(a: str, b: str, why: str) -> None:
    done = echo(a, b, "--timeout", "1.5")
    assert done.returncode == 1
    assert done.stdout == ""
    assert f"no pose of {b} in {a}: " in done.stderr
    assert why in done.stderr


def test_when_the_owner_falls_silent_it_says_so_and_ends(
    write: Callable[..., Path], start: Callable[..., Started], edge: Callable[..., PlanEdge]
) -> None:
    drive = PlanProcess("drive", "simulate", simulate=Simulation("fixed", 50.0))
    owner = start("tfcompose.run.simulate", write([edge("odom base_link", "drive")], drive), "drive")
    command = [sys.executable, "-m", "tfcompose", "echo", "odom", "base_link", "--rate", "20", "--timeout", "1"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout
        assert process.stdout.readline().startswith("pose of base_link in odom")
        owner.end()
        _, errors = process.communicate(timeout=20)
    assert process.returncode == 1
    assert "nothing new came on odom → base_link for 1." in errors


@pytest.mark.usefixtures("domain")
def test_where_nothing_is_published_it_says_so() -> None:
    done = echo("odom", "base_link", "--once", "--timeout", "0.5")
    assert done.returncode == 1
    assert "no TF message came" in done.stderr


class Talker:
    """Sends TF from the test: latched what is fixed, again and again what moves."""

    def __init__(self, node: Any, namespace: str = "") -> None:
        self._publishers = [
            TFPublisher(node, static=static, topic=f"{namespace}{topic}")
            for static, topic in ((False, "/tf"), (True, "/tf_static"))
        ]

    def say(self, parent: str, child: str, x: float, stamp_ns: int = 0, w: float = 1.0) -> None:
        data = encode([Transform(stamp_ns, parent, child, (x, 0.0, 0.0), (0.0, 0.0, 0.0, w))])
        self._publishers[stamp_ns == 0].publish(data)

    def until_heard(self, until: Callable[..., bool]) -> None:
        assert until(lambda: all(each.publisher.get_subscription_count() for each in self._publishers))


@pytest.fixture
def running(domain: Any) -> Iterator[Callable[..., subprocess.Popen[str]]]:
    """Start ``tfcompose echo`` and do not wait."""
    started: list[subprocess.Popen[str]] = []

    def run(*arguments: str) -> subprocess.Popen[str]:
        command = [sys.executable, "-m", "tfcompose", "echo", *arguments]
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
        started.append(subprocess.Popen(command, text=True, env=domain.environment, **pipes))  # type: ignore[call-overload]
        return started[-1]

    yield run
    for process in started:
        process.kill()
        process.communicate()


@pytest.mark.parametrize(
    ("at", "x", "when"),
    [("101.25", "1.25", "at 101.250000000"), ("-0.5", "2.50", "at 102.500000000"), ("103", "3.00", "at 103.000000000")],
)
def test_at_a_time_the_pose_is_interpolated_and_printed_with_as_many_decimals_as_asked(
    running: Callable[..., subprocess.Popen[str]], until: Callable[..., bool], at: str, x: str, when: str
) -> None:
    process = running("odom", "/base_link", "--at", at, "--precision", "2", *(["--once"] if at[0] == "-" else []))
    with open_node("talks", "") as node:
        talker = Talker(node)
        talker.until_heard(until)
        for second in range(4):
            talker.say("odom", "base_link", float(second), (100 + second) * 10**9)
        output, errors = process.communicate(timeout=20)
    assert (process.returncode, errors) == (0, "")
    lines = output.splitlines()
    if at[0] != "-":  # from the newest so far, whichever it was when the first came
        assert when in lines[0]
        assert lines[1:3] == [f"  xyz        [{x}, 0.00, 0.00] m", "  quat_xyzw  [0.00, 0.00, 0.00, 1.00]"]
        assert lines[4] == "             [0, 0, 0] deg"


def test_a_time_that_is_over_is_a_miss_with_the_milliseconds(
    running: Callable[..., subprocess.Popen[str]], until: Callable[..., bool]
) -> None:
    process = running("odom", "base_link", "--at", "99.9", "--timeout", "4")
    with open_node("talks", "") as node:
        talker = Talker(node)
        talker.until_heard(until)
        for second in range(4):
            talker.say("odom", "base_link", float(second), (100 + second) * 10**9)
        _, errors = process.communicate(timeout=20)
    assert process.returncode == 1
    assert (
        "odom → base_link at 99.900000000 s would be extrapolation into the past: its oldest sample is 100 ms" in errors
    )


def test_under_a_namespace_only_its_topics_are_heard(
    running: Callable[..., subprocess.Popen[str]], until: Callable[..., bool]
) -> None:
    with open_node("talks", "") as node:
        ours, others = Talker(node, "/robot1"), Talker(node)
        others.say("odom", "base_link", 9.0)
        ours.say("odom", "base_link", 1.0)
        process = running("odom", "base_link", "--once", "--namespace", "robot1", "--format", "json")
        ours.until_heard(until)
        output, errors = process.communicate(timeout=20)
    assert (process.returncode, errors) == (0, "")
    row = json.loads(output)
    assert (row["xyz"], row["stamp_ns"]) == ([1.0, 0.0, 0.0], None)


def test_when_the_time_starts_again_it_says_so(
    running: Callable[..., subprocess.Popen[str]], until: Callable[..., bool]
) -> None:
    process = running("odom", "base_link", "--timeout", "4", "--rate", "100")
    with open_node("talks", "") as node:
        talker = Talker(node)
        talker.until_heard(until)
        talker.say("odom", "base_link", 1.0, 100 * 10**9)
        talker.say("odom", "base_link", 1.0, 1 * 10**9)
        _, errors = process.communicate(timeout=20)
    assert process.returncode == 1
    assert "what came for base_link was too old to be taken: did a bag or a simulation start again?" in errors


def test_when_simulated_time_starts_again_it_goes_on(
    running: Callable[..., subprocess.Popen[str]], until: Callable[..., bool]
) -> None:
    """A bag that is played with its clock, again and again."""
    process = running("odom", "base_link", "--timeout", "10", "--rate", "100", "--format", "json")
    assert process.stdout
    with open_node("talks", "") as node:
        talker, clock, stop = Talker(node), node.create_publisher(Clock, "/clock", 1), threading.Event()
        talker.until_heard(until)
        second = 100

        def play() -> None:
            while not stop.wait(0.05):
                clock.publish(Clock(clock=Time(sec=second)))
                talker.say("odom", "base_link", float(second), second * 10**9)

        thread = threading.Thread(target=play)
        thread.start()
        try:
            assert json.loads(process.stdout.readline())["xyz"][0] == 100.0
            second = 7
            assert json.loads(process.stdout.readline())["xyz"][0] == 7.0
        finally:
            stop.set()
            thread.join()


def test_what_tf2_refuses_is_said_where_the_frame_is_missing(
    running: Callable[..., subprocess.Popen[str]], until: Callable[..., bool]
) -> None:
    process = running("odom", "base_link", "--timeout", "3")
    with open_node("talks", "") as node:
        talker = Talker(node)
        talker.until_heard(until)
        talker.say("odom", "base_link", 0.0, 10**9, 1.1)
        _, errors = process.communicate(timeout=20)
    assert process.returncode == 1
    assert "what came for base_link was refused: its quaternion is not of length 1" in errors


@pytest.mark.parametrize(
    "words",
    [("--at", "soon"), ("--at", "3000000000"), ("--at", "1.0000000001"), ("--precision", "-1"), ("--rate", "0")],
)
def test_an_option_that_cannot_be_read_is_wrong_use(words: tuple[str, str]) -> None:
    done = echo("odom", "base_link", *words)
    assert done.returncode == 2
    assert words[1] in done.stderr
    assert "Traceback" not in done.stderr
