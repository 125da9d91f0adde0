"""The guard at work: the demo robot, started once, and strangers that join it."""

import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support import processes
from tests.support.domains import Domain, entered_domain
from tests.support.running_robot import RunningRobot
from tests.support.waiting import TIMEOUT_S, in_one_of_a_few, offences, until

pytestmark = [pytest.mark.ros, pytest.mark.xdist_group("one robot for all of these")]

ROBOT = Path(__file__).parents[2] / "robots" / "autonomous_robot.yaml"
#: A stranger with stock settings: node name, topic's kind, rate, seconds, edges. It sends when
#: there is somebody who hears it, and says so; and it stays until it was heard, and then so many
#: seconds.
STRANGER = """
import signal, sys, time
from rclpy.qos import DurabilityPolicy, ReliabilityPolicy
from tfcompose.tf.ros.tf_codec import SentTransform, encode
from tfcompose.tf.ros.node import TFPublisher, open_node, qos
from tfcompose.tf.ros.typesupport import tf_message_type
name, kind, hertz, seconds, *edges = sys.argv[1:]
signal.signal(signal.SIGTERM, lambda *_: sys.exit())  # leave in order: what is killed haunts the graph for 20 s
transforms = [SentTransform(time.time_ns(), *edge.split(), (1.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)) for edge in edges]
with open_node(name, "/strange") as node:
    if kind == "volatile":
        profile = qos(1, DurabilityPolicy.VOLATILE, ReliabilityPolicy.RELIABLE)
        publisher = node.create_publisher(tf_message_type(), "/tf_static", profile)
    else:
        publisher = TFPublisher(node, static=kind == "static")
    raw = getattr(publisher, "publisher", publisher)
    while kind == "moving" and not raw.get_subscription_count():
        time.sleep(0.002)
    publisher.publish(encode(transforms))
    print("sent", flush=True)
    while kind == "static" and not (raw.get_subscription_count() and raw.wait_for_all_acked()):
        time.sleep(0.002)
    end = time.monotonic() + float(seconds)
    while time.monotonic() < end:
        time.sleep(1 / float(hertz))
        if kind == "moving":
            publisher.publish(encode(transforms))
"""  # noqa: E501 (a text as its reader has it)


@pytest.fixture(scope="module")
def domain(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Domain]:
    """A domain as conftest's, for all tests of this module."""
    with entered_domain(tmp_path_factory.mktemp("domain")) as entered:
        yield entered


@pytest.fixture(scope="module")
def robot(domain: Domain, tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningRobot]:
    """The demo robot, complete."""
    assert domain
    running = RunningRobot(tmp_path_factory.mktemp("robot"), str(ROBOT), "--profile", "demo")
    try:
        running.says("tree complete")
        yield running
    finally:
        code = running.end()
    assert code == 0


class Stranger:
    """A node that no plan knows; one at a time."""

    popen: subprocess.Popen[str] | None = None

    def __call__(
        self, name: str, kind: str, *edges: str, hertz: float = 20.0, seconds: float = 600.0
    ) -> None:
        """Let it join and send its first message."""
        self.leaves()
        command = [sys.executable, "-c", STRANGER, name, kind, str(hertz), str(seconds), *edges]
        self.popen = processes.start(command, stdout=subprocess.PIPE)
        assert self.popen.stdout
        assert self.popen.stdout.readline()

    def leaves(self) -> None:
        if self.popen and self.popen.stdout:
            self.popen.terminate()
            self.popen.wait(TIMEOUT_S)
            self.popen.stdout.close()


@pytest.fixture
def stranger(domain: Domain) -> Iterator[Stranger]:
    assert domain
    node = Stranger()
    yield node
    node.leaves()


def test_every_owner_is_announced_and_the_tree_with_the_time_it_took(robot: RunningRobot) -> None:
    live = robot.lines("| live ")
    owners = [
        "static (/tfcompose_static)",
        "joints (/tfcompose_joints)",
        "base_drive (/diff_drive_controller)",
    ]
    for owner in [*owners, "slam (/slam_toolbox)"]:
        assert len([line for line in live if owner in line]) == 1
    assert len(live) == 4
    (complete,) = robot.lines("tree complete: 18 edges live after ")
    assert float(complete.split()[-2]) > 0
    assert offences("".join(robot.lines("TF8"))) == []


def test_a_stranger_on_an_owned_edge_is_named_once(
    robot: RunningRobot, stranger: Stranger
) -> None:
    named = ("error[TF801]", "odom → base_link", "/strange/rogue_odom", "base_drive")
    stranger("rogue_odom", "moving", "odom base_link")
    robot.says(*named)
    stranger.leaves()
    robot.says("over", "odom → base_link", "/strange/rogue_odom")
    assert len(robot.lines(*named)) == 1


def test_a_stranger_that_sends_once_and_leaves_at_once_is_named(
    robot: RunningRobot, stranger: Stranger
) -> None:
    # A message that is sent before anybody is discovered reaches nobody; a latched one waits for
    # its readers.
    def attempt(number: int) -> bool:
        stranger(
            f"rogue_{number}",
            "static",
            "base_link laser_link",
            "base_link imu_link",
            hertz=2,
            seconds=0.5,
        )
        return until(
            lambda: robot.lines("TF801", "base_link → laser_link", f"/strange/rogue_{number};"), 10
        )

    assert in_one_of_a_few(attempt), (
        "a guard that is kept from looking sees a node come and go no more"
    )


@pytest.mark.parametrize(
    ("kind", "edge", "finding"),
    [
        pytest.param(
            "moving",
            "base_footprint base_link",
            ("TF802", "base_link", "base_footprint (from /strange/rogue)", "base_drive"),
            id="a second parent",
        ),
        pytest.param(
            "moving",
            "base_link cup\x1b[31m",
            ("warning[TF803]", "base_link → cup\\x1b[31m", "/strange/rogue"),
            id="an edge that nobody declared",
        ),
        pytest.param(
            "volatile",
            "base_link cup",
            ("TF806", "/strange/rogue", "/tf_static"),
            id="a volatile writer of fixed edges",
        ),
    ],
)
def test_what_a_stranger_does_is_named(
    robot: RunningRobot, stranger: Stranger, kind: str, edge: str, finding: tuple[str, ...]
) -> None:
    stranger("rogue", kind, edge)
    robot.says(*finding)


def test_an_owner_that_falls_silent_is_named_and_when_it_is_back(robot: RunningRobot) -> None:
    drive = robot.child("base_drive")
    silent = ("TF804", "base_drive (/diff_drive_controller)", "odom → base_link")
    back = ("over", "odom → base_link", "back")
    silences, over = len(robot.lines(*silent)), len(robot.lines(*back))
    drive.send_signal(signal.SIGSTOP)
    try:
        robot.says(*silent, times=silences + 1)
    finally:
        drive.send_signal(signal.SIGCONT)
    robot.says(*back, times=over + 1)


def test_a_guard_that_hangs_is_replaced(robot: RunningRobot) -> None:
    guard = robot.child("guard")
    guard.send_signal(signal.SIGSTOP)
    robot.says("TF808", "guard")
    robot.says("over", "guard")
    assert robot.child("guard").pid != guard.pid
