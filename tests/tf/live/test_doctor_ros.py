"""``tfcompose doctor`` on the real thing: real nodes do what is wrong, and it says so."""

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

import psutil
import pytest
from nav_msgs.msg import Odometry
from rclpy.qos import DurabilityPolicy, ReliabilityPolicy
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState, LaserScan
from std_msgs.msg import String

from tests.support import processes
from tests.support.doctor import at_last, doctor, doctor_finds, finds_nothing, messages_of
from tests.support.fake_nodes import FakeNodes, message
from tests.support.processes import Started
from tests.support.waiting import until
from tfcompose.tf.ros.node import LATCHED, TFPublisher, qos
from tfcompose.tf.ros.typesupport import tf_message_type

pytestmark = pytest.mark.ros

GCC = shutil.which("gcc") or ""
ROBOT = str(Path(__file__).parents[3] / "robots" / "autonomous_robot.yaml")

SECOND_NS = 1_000_000_000
VOLATILE, RELIABLE = DurabilityPolicy.VOLATILE, ReliabilityPolicy.RELIABLE
BEST_EFFORT = ReliabilityPolicy.BEST_EFFORT
ARM = """<robot name="arm"><link name="base_link"/><link name="upper_arm"/><link name="hand"/>
<joint name="shoulder" type="revolute"><parent link="base_link"/><child link="upper_arm"/></joint>
<joint name="wrist" type="fixed"><parent link="upper_arm"/><child link="hand"/></joint></robot>"""


def sound(nodes: FakeNodes) -> Any:
    """A robot with nothing wrong."""
    node = nodes.node("drive")
    nodes.moving(node, "odom base_link")
    nodes.fixed(node, "base_link laser")
    return node


def scan(frame: str, late_s: float = 0.0) -> Callable[[int], LaserScan]:
    def make(now: int) -> LaserScan:
        scan = LaserScan()
        scan.header.frame_id = frame
        scan.header.stamp.sec, scan.header.stamp.nanosec = divmod(
            now - int(late_s * SECOND_NS), SECOND_NS
        )
        return scan

    return make


def wrong_trees_and_publishers(nodes: FakeNodes) -> None:
    describes(nodes, sound(nodes))
    nodes.fixed(nodes.node("cam"), "base_lnk camera")
    nodes.moving(nodes.node("left"), "ring_a ring_b", "base_link pan")
    nodes.moving(nodes.node("right"), "ring_b ring_a", "base_link pan")
    nodes.moving(nodes.node("slam"), "map base_link")
    nodes.moving(nodes.node("old"), "/odom /gps")
    nodes.moving(nodes.node("arm"), "base_link arm", quat=(0.0, 0.0, 0.0, 0.9))
    nodes.moving(nodes.node("itself"), "base_link base_link")
    nodes.moving(nodes.node("lift"), "base_link lift")
    nodes.fixed(nodes.node("old_lift"), "base_link lift")
    nodes.odd(
        nodes.node("mounts"),
        "base_link tray",
        topic="/tf_static",
        profile=qos(1, VOLATILE, RELIABLE),
    )
    nodes.odd(
        nodes.node("lossy"), "base_link lossy", topic="/tf", profile=qos(10, VOLATILE, BEST_EFFORT)
    )
    nodes.keep(
        nodes.node("viewer").create_subscription(
            tf_message_type(), "/tf_static", lambda _: None, 10, raw=True
        )
    )
    nodes.typed(nodes.node("older"), String, "/tf", lambda _: String(data="a b"))
    publisher = nodes.keep(TFPublisher(nodes.node("bridge"), static=False))
    nodes.every(10, lambda _: publisher.publish(b"\x00\x01\x00\x00\xff\xff\xff\x7f no transforms"))
    nodes.moving(nodes.node("drive", "robot1"), "odom base_link", topic="/robot1/tf")
    nodes.moving(nodes.node("ekf", "robot1"), "base_link robot1_imu")
    node = nodes.node("nav")
    nodes.keep(node.create_subscription(Clock, "/clock", lambda _: None, 1))


def wrong_times_and_data(nodes: FakeNodes) -> None:
    """Each edge is stamped wrong in a way of its own, or comes too rarely.

    Scans are stamped as they are measured, and odometry a second late. Of the joints one is
    misspelt.
    """
    began, rotations, ticks = time.time_ns(), iter(range(1_000_000)), iter(range(1_000_000))
    node = nodes.node("drive")
    nodes.moving(node, "odom base_link", hz=4, stamp=lambda now: now - SECOND_NS)
    nodes.fixed(node, "base_link laser")
    describes(nodes, node)
    nodes.moving(nodes.node("frozen"), "base_link frozen", stamp=lambda _: began)
    nodes.moving(
        nodes.node("back"),
        "base_link back",
        stamp=lambda now: now - next(rotations) % 2 * SECOND_NS // 4,
    )
    nodes.moving(nodes.node("zero"), "base_link zero", stamp=lambda _: 0)
    nodes.moving(nodes.node("gazebo"), "base_link wheel", stamp=lambda now: now - began)
    nodes.moving(nodes.node("late"), "base_link late", stamp=lambda now: now - 2 * SECOND_NS)
    nodes.moving(nodes.node("amcl"), "map odom", stamp=lambda now: now + 3 * SECOND_NS)
    paused = nodes.keep(TFPublisher(nodes.node("paused"), static=False))

    def now_and_then(now: int) -> None:
        if next(ticks) % 100 < 50:
            paused.publish(message(now, ("base_link paused",)))

    nodes.every(40, now_and_then)
    for name, frame, late_s in (
        ("new", "laser", 0.0),
        ("stale", "laser", 14.0),
        ("lost", "lasr", 0.0),
        ("slashed", "/laser", 0.0),
    ):
        nodes.typed(nodes.node(name), LaserScan, f"/{name}/scan", scan(frame, late_s))
    states = JointState(name=["sholder"], position=[0.0])
    nodes.typed(nodes.node("broadcaster"), JointState, "/joint_states", lambda _: states)


def describes(nodes: FakeNodes, node: Any) -> None:
    """Let the node be a robot state publisher, as it is seen from outside."""
    nodes.keep(node.create_publisher(String, "/robot_description", LATCHED)).publish(
        String(data=ARM)
    )
    nodes.keep(node.create_subscription(JointState, "/joint_states", lambda _: None, 1))


def clocks_that_stand(nodes: FakeNodes) -> None:
    """Two simulators are paused; a node has a publisher for each fixed frame."""
    sound(nodes)
    nodes.keep(nodes.node("nav").create_subscription(Clock, "/clock", lambda _: None, 1))
    for name in ("sim", "bag"):
        nodes.typed(nodes.node(name), Clock, "/clock", lambda _: Clock())
    states = JointState(name=["a"], position=[0.0])
    nodes.typed(nodes.node("broadcaster"), JointState, "/joint_states", lambda _: states)
    many = nodes.node("many")
    for number in range(100):
        nodes.fixed(many, f"base_link part_{number}")


#: What is found in each scene, and what is named there.
SCENES: dict[Callable[[FakeNodes], None], dict[str, list[str]]] = {
    wrong_trees_and_publishers: {
        "TF830": ["base_lnk", "camera", "/cam", "base_link"],
        "TF820": ["ring_a → ring_b", "/left", "/right"],
        "TF822": ["base_link → pan", "/left", "/right", "same", "Hz", "pid"],
        "TF802": ["base_link", "map", "odom", "/drive", "/slam"],
        "TF501": ["/old", "odom → gps"],
        "TF831": ["/arm", "base_link → arm", "0.900"],
        "TF821": ["/itself", "base_link → base_link"],
        "TF809": ["lift", "/tf ", "/lift", "/tf_static", "/old_lift"],
        "TF806": ["/mounts", "/tf_static"],
        "TF826": ["/lossy", "/tf"],
        "TF849": ["/viewer", "/tf_static", "transient_local"],
        "TF832": ["/older", "std_msgs/msg/String", "/tf", "/bridge", "tf2_msgs/msg/TFMessage"],
        "TF827": ["/robot1/ekf", "/robot1/tf"],
        "TF836": ["/nav", "/clock"],
        "TF843": ["/drive", "/joint_states", "base_link → upper_arm"],
    },
    wrong_times_and_data: {
        "TF838": ["odom → base_link", "/drive", "20 Hz"],
        "TF823": ["/frozen", "base_link → frozen"],
        "TF824": ["/back", "base_link → back"],
        "TF825": [
            "/zero",
            "base_link → zero",
            "use_sim_time",
            "/gazebo",
            "base_link → wheel",
            "simulated",
        ],
        "TF833": ["base_link → late", "/late", "2 s"],
        "TF835": ["/amcl", "map → odom"],
        "TF839": ["base_link → paused", "/paused", " 1."],
        "TF841": [
            "/new/scan",
            "odom → base_link",
            "/drive",
            "future",
            "/stale/scan",
            "13 s",
            "past",
        ],
        "TF840": ["/lost/scan", "/lost", "lasr", "laser?", "/slashed/scan", "/laser", "frame_id"],
        "TF844": ["shoulder", "base_link → upper_arm", "/broadcaster"],
        "TF861": ["sholder", "/broadcaster"],
    },
    clocks_that_stand: {
        "TF836": ["/nav", "/clock", "/sim", "0.000 s"],
        "TF837": ["/clock", "/bag", "/sim"],
        "TF842": ["/broadcaster", "/joint_states"],
        "TF309": ["101", "/tf_static", "/many"],
    },
}


#: What is true of publishers on a machine that does much else; what follows from two clocks, or
#: two publishers.
LATE = {"TF805", "TF833", "TF838", "TF839", "TF824", "TF825"}


@pytest.mark.parametrize("scene", SCENES, ids=lambda scene: scene.__name__)
def test_what_is_wrong_is_found_with_the_nodes_and_the_numbers(
    nodes: FakeNodes, scene: Callable[[FakeNodes], None]
) -> None:
    scene(nodes)

    def are_found(seconds: float) -> None:
        exit_code, findings = doctor(seconds=seconds)
        assert exit_code == 1
        for code, names in SCENES[scene].items():
            text = messages_of(findings, code)
            assert [name for name in names if name not in text] == [], text
        assert {entry["code"] for entry in findings if not in_a_pause(entry)} <= {
            *SCENES[scene],
            *LATE,
        }, findings

    at_last(are_found)


def in_a_pause(entry: dict[str, Any]) -> bool:
    """Return whether the observation ended during /paused's pause.

    It pauses half of the time.
    """
    return entry["code"] == "TF804" and str(entry["message"]).startswith("/paused ")


def test_a_sound_robot_gives_no_finding_and_exit_code_0(nodes: FakeNodes) -> None:
    sound(nodes)
    nodes.typed(nodes.node("lidar"), LaserScan, "/scan", scan("laser", 0.05))
    nodes.typed(nodes.node("wheels"), Odometry, "/odometry", odometry)
    assert finds_nothing()


def odometry(now: int) -> Odometry:
    made = Odometry()
    made.header.frame_id = "odom"
    made.header.stamp.sec, made.header.stamp.nanosec = divmod(now, SECOND_NS)
    return made


@pytest.mark.usefixtures("nodes")
def test_where_nothing_runs_it_reports_with_which_settings_it_observed(domain: Any) -> None:
    code, findings = doctor(seconds=1.0)
    text = messages_of(findings, "TF845")
    assert code == 1
    assert f"ROS_DOMAIN_ID={domain.id}, ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST" in text


FAR = """
import time
from tfcompose.tf.ros.node import open_node
with open_node("far", ""):
    print("up", flush=True)
    time.sleep(60)
"""


@pytest.mark.alone
@pytest.mark.slow
def test_a_robot_in_another_domain_is_observed_by_its_process(domain: Any) -> None:
    """It runs on this machine, and it cannot be heard.

    The process says in which domain it was started.

    It runs alone: of many such processes on a machine doctor names the first few.
    """
    environment = {**domain.environment, "ROS_DOMAIN_ID": "101"}
    command = [sys.executable, "-c", FAR]

    def is_observed(seconds: float) -> None:
        with processes.start(command, stdout=subprocess.PIPE, env=environment) as process:
            try:
                assert process.stdout
                assert process.stdout.readline() == "up\n"
                text = messages_of(doctor(seconds=seconds / 3)[1], "TF908")
            finally:
                process.kill()
        assert "ROS_DOMAIN_ID=101 tfcompose doctor" in text
        assert f"pid {process.pid}: " in text

    at_last(
        is_observed
    )  # what others run here at the same time may have been started later, and is named first


SHIM = """
#define _GNU_SOURCE
#include <dlfcn.h>
#include <time.h>
int clock_gettime(clockid_t id, struct timespec *now) {
    static int (*real)(clockid_t, struct timespec *);
    if (!real) real = (int (*)(clockid_t, struct timespec *))dlsym(RTLD_NEXT, "clock_gettime");
    int code = real(id, now);
    if (id == CLOCK_REALTIME) now->tv_sec += 3;
    return code;
}
"""
TALKER = """
import time
from tfcompose.tf.ros.tf_codec import SentTransform, encode
from tfcompose.tf.ros.node import TFPublisher, open_node
with open_node("far", "") as node:
    publisher = TFPublisher(node, static=False)
    print("up", flush=True)
    while True:
        publisher.publish(encode([SentTransform(time.time_ns(), "odom", "base_link", (0.0,) * 3, (0.0, 0.0, 0.0, 1.0))]))
        time.sleep(0.03)
"""  # noqa: E501 (a text as its reader has it)


@pytest.mark.skipif(not GCC, reason="the clock of a process is set by a library that gcc makes")
@pytest.mark.usefixtures("nodes")
def test_the_clock_of_another_machine_is_named_with_how_far_it_is_off(tmp_path: Path) -> None:
    (tmp_path / "shim.c").write_text(SHIM, encoding="utf-8")
    library = str(tmp_path / "shim.so")
    processes.run(
        [GCC, "-shared", "-fPIC", "-o", library, str(tmp_path / "shim.c"), "-ldl"], check=True
    )
    environment = {**os.environ, "LD_PRELOAD": library}
    command = [sys.executable, "-c", TALKER]
    with processes.start(command, stdout=subprocess.PIPE, env=environment) as talker:
        try:
            assert talker.stdout
            assert talker.stdout.readline() == "up\n"
            findings = doctor_finds({"TF834": ["/far"]}, set())
        finally:
            talker.kill()
    text = messages_of(findings, "TF834")
    assert re.search(r" (3|2\.9\d) s ahead ", text), text
    assert {entry["code"] for entry in findings} == {"TF834"}


def test_a_robot_as_planned_gives_no_finding_and_each_difference_is_one(
    start: Callable[..., Started], nodes: FakeNodes
) -> None:
    """The example's stand-ins; without the profile the plan expects a camera's driver."""
    up = start("up", ROBOT, "--profile", "demo")
    up.until_says("all ready")
    with ThreadPoolExecutor() as both:
        assert all(
            both.map(lambda words: finds_nothing(*words), [(ROBOT, "--profile", "demo"), ()])
        )
    nodes.fixed(nodes.node("rogue"), "base_link laser_link", x=0.1)

    def is_reported(seconds: float) -> None:
        text = messages_of(doctor(ROBOT, seconds=seconds)[1], "TF801")
        for name in (
            "base_link → laser_link",
            "/rogue",
            "static (/tfcompose_static)",
            "camera (/camera/camera)",
        ):
            assert name in text

    at_last(is_reported)
    up.end()


def test_ctrl_c_ends_the_observation_and_prints_what_was_found(
    nodes: FakeNodes, start: Callable[..., Started]
) -> None:
    nodes.moving(node := nodes.node("drive"), "odom base_link", stamp=lambda _: 0)

    def is_named(seconds: float) -> None:
        process = start("doctor", "--for", "600")
        assert until(lambda: node.count_subscribers("/tf"))
        time.sleep(seconds)  # it is to have looked for so long
        code = process.end(signal.SIGINT)
        process.close()
        assert (code, process.errors) == (1, [])
        assert "TF825" in process.output

    at_last(is_named)


def test_ctrl_c_before_anything_came_is_no_finding(
    start: Callable[..., Started], tmp_path: Path
) -> None:
    robot = tmp_path / "robot.yaml"
    robot.write_text("{tfcompose: 1, robot: a, frames: {b: {}, c: {parent: b}}}")
    commands = (
        ["monitor"],
        ["verify", robot, "--for", "600"],
        ["graph", "--live", "-o", tmp_path / "tree.svg", "--for", "600"],
    )

    def is_none(_: float) -> None:
        for words in commands:
            started = start(*words)
            assert until(partial(has_begun, started.process))
            code = started.end(signal.SIGINT)
            started.close()
            assert (code, started.output) == (130, ""), started.errors
            assert len(started.errors) <= 1, started.errors
            assert all(re.match(r"tfcompose: .* \d\.\d s", line) for line in started.errors)

    at_last(is_none)  # after 2 s it has looked for long enough to say that there is nothing


def has_begun(process: subprocess.Popen[str]) -> bool:
    """Return whether the process has joined ROS: it has UDP ports, whoever has found it yet.

    Or has ended.
    """
    return process.poll() is not None or bool(psutil.Process(process.pid).net_connections("udp"))


def test_other_robots_in_the_same_domain_are_reported(nodes: FakeNodes) -> None:
    sound(nodes)
    nodes.moving(nodes.node("drive", "robot2"), "odom base_link", topic="/robot2/tf")
    command = [sys.executable, "-m", "tfcompose", "doctor", "--for"]

    def is_named(seconds: float) -> None:
        done = processes.run([*command, str(seconds)])
        assert "/robot2/tf" in done.stdout.splitlines()[-1]
        assert done.stdout.endswith("--namespace /robot2\n")

    at_last(is_named)


OTHER_RMW = """
import mmap, sys, threading, time
for _ in range(4):  # each middleware has more
    threading.Thread(target=time.sleep, args=[60], daemon=True).start()
with open(sys.argv[1], "rb") as file:
    library = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
    print("up", flush=True)
    time.sleep(60)
"""


def test_a_process_with_another_middleware_is_named(domain: Any) -> None:
    """ROS's wheels bring one middleware, and a node that asks for another ends.

    What has rcl mapped, and threads, stands for it.
    """
    rcl = next(
        path
        for folder in os.environ["LD_LIBRARY_PATH"].split(":")
        if (path := Path(folder, "librcl.so")).exists()
    )
    environment = {**domain.environment, "RMW_IMPLEMENTATION": "rmw_cyclonedds_cpp"}
    command = [sys.executable, "-c", OTHER_RMW, str(rcl)]
    with processes.start(command, stdout=subprocess.PIPE, env=environment) as process:
        try:
            assert process.stdout
            assert process.stdout.readline() == "up\n"
            _, findings = doctor(seconds=1.0)
        finally:
            process.kill()
    text = messages_of(findings, "TF908")
    assert "RMW_IMPLEMENTATION=rmw_cyclonedds_cpp" in text
    assert "rmw_fastrtps_cpp" in text
    assert f"pid {process.pid}: " in text


@pytest.mark.parametrize(
    ("command", "setting", "code", "exit_code"),
    [
        ("doctor", "RMW_IMPLEMENTATION=rmw_none_cpp", "TF901", 2),
        ("monitor --for 1", "ROS_DOMAIN_ID=300", "TF909", 1),
        ("echo a b --once", "RMW_IMPLEMENTATION=rmw_none_cpp", "TF901", 2),
        ("tree --live", "ROS_DOMAIN_ID=lab", "TF909", 1),
    ],
)
@pytest.mark.usefixtures("domain")
def test_every_live_command_reports_settings_that_keep_ros_from_starting(
    monkeypatch: pytest.MonkeyPatch, command: str, setting: str, code: str, exit_code: int
) -> None:
    """ROS itself ends the process, with exit code 102, or with Fast DDS's own words."""
    monkeypatch.setenv(*setting.split("="))
    done = processes.run([sys.executable, "-m", "tfcompose", *command.split()])
    output = done.stdout + done.stderr
    assert done.returncode == exit_code
    assert output.startswith(f"error[{code}] {setting}")
    assert len(output.splitlines()) == 2
