"""Faults of owners and strangers on the real thing: loops, stamps, QoS, leaks.

The guard names each.
"""

import json
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import psutil
import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus

from tests.support import processes
from tests.support.domains import entered_domain
from tests.support.running_robot import RunningRobot, command_of
from tests.support.waiting import TIMEOUT_S, in_one_of_a_few, until

pytestmark = pytest.mark.ros

ROBOT = """
tfcompose: 1
robot: faulty
ros: {discovery: localhost}
links: {base_link: {}}
frames:
  map: {}
  odom: {parent: map, owner: slam, rate: 10 Hz}
  base_link: {parent: odom, owner: drive}
processes:
  slam: {simulate: {fixed: {}, rate: 10 Hz}}
  drive: {external: true, node: /drive}
guard: {allow: [{parent: map, child: "person_*"}]}
"""
#: Its owner comes far more often than it must, so that it falls silent only if it is kept from
#: running for long.
PATIENT = ROBOT.replace("owner: slam, rate: 10 Hz", "owner: slam, rate: 1 Hz")
#: A node that sends edges at 20 Hz: full name, QoS, how it stamps, edges.
NODE = """
import os, signal, sys, time
from rclpy.qos import DurabilityPolicy, ReliabilityPolicy
from tfcompose.tf.ros.tf_codec import SentTransform, encode
from tfcompose.tf.ros.node import open_node, qos
from tfcompose.tf.ros.typesupport import tf_message_type
name, reliability, stamps, *edges = sys.argv[1:]
signal.signal(signal.SIGTERM, lambda *_: sys.exit())
begun = time.time_ns()
def stamp(n):
    now = time.time_ns()
    return {"right": now, "frozen": begun, "since start": now - begun, "none": 0,
            "back": now - 2 * 10**9 * (n % 10 == 9)}[stamps]
namespace, _, name = name.rpartition("/")
with open_node(name, namespace) as node:
    profile = qos(100, DurabilityPolicy.VOLATILE, ReliabilityPolicy[reliability.upper()])
    publisher = node.create_publisher(tf_message_type(), "/tf", profile)
    print("ready", flush=True)
    n = 0
    while True:
        n += 1
        transforms = [SentTransform(stamp(n), *edge.split(), (1., 0., 0.), (0., 0., 0., 1.)) for edge in edges]
        publisher.publish(encode(transforms))
        time.sleep(0.05)
"""  # noqa: E501 (a text as its reader has it)


class Running(RunningRobot):
    """A robot, and the nodes that a test lets join."""

    def __init__(self, folder: Path, text: str) -> None:
        (folder / "robot.yaml").write_text(text, encoding="utf-8")
        super().__init__(folder)
        self.nodes: list[subprocess.Popen[str]] = []

    def joins(
        self, name: str, *edges: str, reliability: str = "reliable", stamps: str = "right"
    ) -> int:
        """Let a node send these edges, and return its process id."""
        return self.starts(NODE, name, reliability, stamps, *edges)

    def starts(self, code: str, *arguments: str) -> int:
        """Start a node of this code, wait for its first line, and return its process id."""
        node = processes.start([sys.executable, "-c", code, *arguments], stdout=subprocess.PIPE)
        self.nodes.append(node)
        assert node.stdout
        assert node.stdout.readline()
        return node.pid

    def leaves(self) -> None:
        """Let all nodes leave."""
        for node in self.nodes:
            node.terminate()
            node.wait(TIMEOUT_S)
            if node.stdout:
                node.stdout.close()
        self.nodes.clear()

    def end(self) -> int:
        self.leaves()
        return super().end()


@pytest.fixture
def up(domain: object, tmp_path: Path) -> Iterator[Callable[[str], Running]]:
    """Start a robot and wait until it is.

    Who joins before the end of the first look was there before the start.
    """
    assert domain
    robots: list[Running] = []

    def start(text: str) -> Running:
        robots.append(Running(tmp_path, text))
        robots[0].says("started slam")
        return robots[0]

    yield start
    for robot in robots:
        robot.end()


@pytest.fixture(scope="module")
def faulty(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    """A robot that is complete, for the tests of its group, in their order."""
    folder = tmp_path_factory.mktemp("faulty")
    with entered_domain(folder):
        robot = Running(folder, PATIENT)
        processes.share(robot.popen)
        robot.says("started slam")
        robot.joins("/drive", "odom base_link")
        robot.says("complete")
        drive = robot.nodes.pop()
        processes.share(drive)
        yield robot
        robot.nodes.append(drive)
        robot.end()


of_one_robot = pytest.mark.xdist_group("faulty")


@of_one_robot
def test_what_the_guard_knows_and_finds_is_on_the_diagnostics_page(faulty: Running) -> None:
    faulty.joins("/rogue", "map odom")
    faulty.says("TF801")
    pages: list[Any] = []

    def last() -> dict[str, Any]:
        return (
            {line.name.removeprefix("tfcompose faulty: "): line for line in pages[-1].status}
            if pages
            else {}
        )

    def reported() -> bool:
        """Return whether the page says what is.

        A process that was kept from running is slow for a while.
        """
        rclpy.spin_once(reader, timeout_sec=0.1)
        if not pages or last()["slam"].level != DiagnosticStatus.OK:
            return False
        return any(" Hz" in pair.value for pair in last()["slam"].values)

    rclpy.init()
    try:
        reader: Any = rclpy.create_node("reader")
        reader.create_subscription(DiagnosticArray, "/diagnostics", pages.append, 10)
        assert until(reported), pages
        reader.destroy_node()
    finally:
        rclpy.shutdown()
    tree, slam = last()["tree"], last()["slam"]
    assert (tree.level, tree.hardware_id) == (DiagnosticStatus.ERROR, "faulty")
    assert all(name in tree.message for name in ("TF801", "map → odom", "/rogue"))
    assert [pair.key for pair in slam.values] == ["map → odom"]
    assert "from /slam" in slam.values[0].value
    faulty.leaves()
    faulty.says("over", "map → odom", "/rogue")


@of_one_robot
def test_what_strangers_do_to_the_tree_is_named_as_what_it_is(faulty: Running) -> None:
    pid = faulty.joins("/strange/loop", "base_link map")
    loop = ("map → odom → base_link → map", "base_link → map from /strange/loop")
    faulty.says(
        "error[TF820]", *loop, notes=(f"/strange/loop runs on this machine as pid {pid}: ",)
    )
    faulty.joins("/strange/itself", "odom odom")
    faulty.says("warning[TF821]", "/strange/itself", "odom → odom")
    faulty.joins("/strange/best", "base_link cup", reliability="best_effort")
    faulty.says("error[TF826]", "/strange/best", "/tf")
    faulty.joins("/tracker_a", "map person_1")
    faulty.joins("/tracker_b", "map person_1")
    faulty.says("warning[TF822]", "map → person_1", "/tracker_a", "/tracker_b")
    faulty.leaves()
    faulty.says("over", "base_link → map", "/strange/loop")
    assert "TF803" not in faulty.text


@of_one_robot
def test_a_killed_guard_returns_with_its_memory_and_repeats_nothing(
    faulty: Running,
) -> None:
    faulty.joins("/first", "map odom")
    faulty.says("TF801", "/first")
    faulty.child("guard").kill()
    faulty.says("warning[TF808]", "guard", "SIGKILL")
    faulty.says("over", "guard")
    faulty.joins("/second", "map odom")
    faulty.says("TF801", "/second")
    faulty.leaves()
    faulty.says("over", "map → odom", "/first")
    assert len(faulty.lines("TF801", "/first;")) == 1
    assert (
        len(faulty.lines("| live ")),
        len(faulty.lines("complete")),
        len(faulty.lines("watching 2 edges again")),
    ) == (2, 1, 1)


#: A node that latches its edges one message each: before anybody can have found it, if nobody
#: looks meanwhile.
LATCHES = """
import signal, sys, time
from tfcompose.tf.ros.tf_codec import SentTransform, encode
from tfcompose.tf.ros.node import TFPublisher, open_node
signal.signal(signal.SIGTERM, lambda *_: sys.exit())
with open_node("mounts", "/") as node:
    publisher = TFPublisher(node, static=True)
    for child in ("camera", "lidar"):
        publisher.publish(encode([SentTransform(time.time_ns(), "base_link", child, (1., 0., 0.), (0., 0., 0., 1.))]))
    print("ready", flush=True)
    while True:
        time.sleep(1)
"""  # noqa: E501 (a text as its reader has it)


def test_an_owner_that_replaced_an_unheard_latched_edge_is_named(
    up: Callable[[str], Running],
) -> None:
    mounts = "  camera: {parent: base_link, owner: mounts, static: true}\n"
    mounts += "  lidar: {parent: base_link, owner: mounts, static: true}\nprocesses:\n"
    robot = up(
        ROBOT.replace("processes:\n", mounts + "  mounts: {external: true, node: /mounts}\n")
    )
    robot.joins("/drive", "odom base_link")
    guard = robot.child("guard")
    guard.send_signal(signal.SIGSTOP)
    assert until(lambda: guard.status() == psutil.STATUS_STOPPED)
    robot.starts(LATCHES)
    guard.send_signal(signal.SIGCONT)
    robot.says("warning[TF850]", "/mounts", "/tf_static", "base_link → camera")
    assert len(robot.lines("TF850")) == 1


#: A child that owns an edge, and once there is a file "lie" sends that of another, too.
TRAITOR = NODE.replace("for edge in edges]", "for edge in edges[: 1 + os.path.exists('lie')]]")


def test_policy_stop_offender_stops_own_offenders_and_no_strangers(
    up: Callable[[str], Running], tmp_path: Path
) -> None:
    (tmp_path / "traitor.py").write_text(TRAITOR, encoding="utf-8")
    run = json.dumps(
        [sys.executable, "traitor.py", "/traitor", "reliable", "right", "odom cup", "map odom"]
    )
    text = ROBOT.replace(
        "processes:\n",
        f"  cup: {{parent: odom, owner: traitor}}\nprocesses:\n  traitor: {{run: {run}}}\n",
    )
    robot = up(text.replace("guard: {", "guard: {on_violation: stop-offender, "))
    robot.joins("/drive", "odom base_link")
    robot.says("live", "map → odom")
    robot.joins("/stranger", "map odom")
    robot.says("error[TF801]", "map → odom", "/stranger;")
    (tmp_path / "lie").touch()
    robot.says(
        "error[TF801]", "map → odom", "/traitor;", "slam (/slam)", notes=("traitor is stopped",)
    )
    robot.says("over", "map → odom", "/traitor")
    assert len(robot.lines("traitor is stopped")) == 1
    assert robot.popen.poll() is None

    def children() -> list[list[str]]:
        return [command_of(process) for process in robot.below(recursive=False)]

    assert until(lambda: not any("traitor.py" in words for words in children()))
    assert {"guard", "slam"} <= {words[-1] for words in children() if words}


#: A node that sends edges of others at 1 kHz.
FLOOD = """
import signal, sys, time
from tfcompose.tf.ros.tf_codec import Template
from tfcompose.tf.ros.node import TFPublisher, open_node
signal.signal(signal.SIGTERM, lambda *_: sys.exit())
with open_node("rogue", "/") as node:
    publisher, template, due = TFPublisher(node, static=False), Template([("map", "odom")]), time.monotonic()
    print("ready", flush=True)
    while True:
        template.set_stamp(time.time_ns())
        publisher.publish(template.data)
        due += 0.001
        time.sleep(max(0.0, due - time.monotonic()))
"""  # noqa: E501 (a text as its reader has it)
#: The least that any rclpy listener does with the same messages: it takes their bytes.
LISTENER = """
import signal, sys
import rclpy
from rclpy.qos import QoSProfile
from tfcompose.tf.ros.typesupport import tf_message_type
from rclpy.signals import SignalHandlerOptions
signal.signal(signal.SIGTERM, lambda *_: sys.exit())
rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
node, numbers = rclpy.create_node("plain_listener"), iter(range(1, 10**9))
def take(data):
    if next(numbers) == 500:  # it has found who sends so many, not only others
        print("hears", flush=True)
node.create_subscription(tf_message_type(), "/tf", take, QoSProfile(depth=100), raw=True)
rclpy.spin(node)
"""
#: A node with so many latched publishers: one for each frame, as a static_transform_publisher is.
MANY = """
import signal
from tfcompose.tf.ros.tf_codec import SentTransform, encode
from tfcompose.tf.ros.node import TFPublisher, open_node
with open_node("foreign", "/") as node:
    publishers = [TFPublisher(node, static=True) for _ in range(120)]
    for n, publisher in enumerate(publishers):
        publisher.publish(encode([SentTransform(1, "map", f"dock_{n}", (1.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))]))
    print("ready", flush=True)
    signal.pause()
"""  # noqa: E501 (a text as its reader has it)
GUARDS = ["mode: watch", "mode: strict, fence: partition"]


@pytest.mark.slow
@pytest.mark.alone
@pytest.mark.parametrize("guard", GUARDS)
def test_a_rogue_at_1_khz_is_named_once_and_costs_the_guard_little(
    up: Callable[[str], Running], guard: str
) -> None:
    robot = up(ROBOT.replace("guard: {", f"guard: {{{guard}, "))
    robot.joins("/drive", "odom base_link")
    robot.says("complete")
    silent = len(robot.lines("fell silent"))
    robot.starts(FLOOD)
    robot.says("error[TF801]", "map → odom", "/rogue;", "slam (/slam)")
    both = [robot.child("guard"), psutil.Process(robot.starts(LISTENER))]

    def attempt(_: int) -> bool:
        """Return whether nobody fell silent.

        One who is kept from running does, and not each time.
        """
        nonlocal silent
        before_s, before_bytes = (
            [sum(each.cpu_times()[:2]) for each in both],
            both[0].memory_info().rss,
        )
        time.sleep(4)
        guard_s, listener_s = (
            sum(each.cpu_times()[:2]) - s for each, s in zip(both, before_s, strict=True)
        )
        assert guard_s < 2 * listener_s
        assert both[0].memory_info().rss < 1.1 * before_bytes
        before, silent = silent, len(robot.lines("fell silent"))
        return silent == before

    assert in_one_of_a_few(attempt)
    assert len(robot.lines("TF801")) == 1
    robot.leaves()
    robot.says("over", "map → odom", "/rogue")


@pytest.mark.slow
@pytest.mark.alone
@pytest.mark.parametrize("guard", GUARDS)
def test_static_publishers_beyond_a_listeners_depth_are_all_received(
    up: Callable[[str], Running], guard: str
) -> None:
    foreign = processes.start([sys.executable, "-c", MANY], stdout=subprocess.PIPE)
    try:
        assert foreign.stdout
        assert foreign.stdout.readline()
        robot = up(ROBOT.replace("guard: {", f"guard: {{{guard}, "))
        robot.joins("/drive", "odom base_link")
        robot.says("complete")
        reported = re.compile(r"dock_\d+(?: and (\d+) more)?.* published by /foreign")

        def named() -> int:
            return sum(
                1 + int(more or 0) for more in reported.findall(robot.output.read_text("utf-8"))
            )

        assert until(lambda: named() == 120), named()
    finally:
        foreign.kill()
        foreign.communicate()
