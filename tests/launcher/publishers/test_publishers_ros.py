"""The publishing processes as they run: real processes, heard by a node of the test.

How they move, by which clock, and what they say of joints: test_histories_ros.
"""

import math
import signal
import time
from collections.abc import Callable
from typing import Any

import pytest
from rclpy.serialization import deserialize_message
from scipy.spatial.transform import Rotation
from sensor_msgs.msg import JointState
from std_msgs.msg import String

from tests.support.waiting import until
from tfcompose.foundation.geometry import Pose, angle_between, quat_from_rpy
from tfcompose.foundation.signals import Stop
from tfcompose.model.plan import PlanJoint, PlanProcess, ProcessKind, Simulation
from tfcompose.tf.ros.graph import writers
from tfcompose.tf.ros.node import LATCHED, Received, Subscription, TFSubscription, latch, wait
from tfcompose.tf.ros.tf_codec import SentTransform, decode

pytestmark = pytest.mark.ros

UNTIL_S = 30.0
Y = (0.0, 1.0, 0.0)
Make = Callable[..., Any]


def take(node: Any, subscription: Subscription) -> list[Received]:
    """Return what comes next."""
    received: list[Received] = []

    def come() -> bool:
        wait(node, [subscription], 0.2, Stop())
        received.extend(subscription.take())
        return bool(received)

    assert until(come)
    return received


def described(node: Any) -> str:
    """Return the robot's description, as who joins now gets it."""
    subscription = Subscription(node, String, "/rover/robot_description", LATCHED)
    text: str = deserialize_message(take(node, subscription)[0].data, String).data
    return text


@pytest.fixture
def rover(edge: Make, write: Make) -> Any:
    """A robot with two wheels, a mimic of the left one, and a gripper with a mimic of that."""
    axle = Pose((0.1, 0.2, 0.0), quat_from_rpy(0.3, 0.0, 0.0))
    moving = [
        edge(f"base {joint.name}", "joints", pose, joint)
        for pose, joint in (
            (None, PlanJoint("finger", "prismatic", Y, "follower", 0.01, 0.002)),
            (None, PlanJoint("follower", "continuous", Y, "left", -2.0, 0.5)),
            (axle, PlanJoint("left", "continuous", Y)),
            (axle, PlanJoint("right", "revolute", Y)),
        )
    ]
    return write(moving, PlanProcess("joints", "joints"))


def test_a_late_joiner_gets_all_fixed_edges_in_one_message_from_the_node(
    start: Make, node: Any, edge: Make, write: Make
) -> None:
    """Its command line renames it, and the plan moves its topic into its namespace."""
    edges = [edge(f"base_link frame_{n}", "static", Pose((n, 0.0, 0.0))) for n in range(150)]
    static = PlanProcess(
        "static", "static", nodes=("/fleet/r1/frames",), remap={"/tf_static": "tf_static"}
    )
    plan = write(
        [*edges, edge("odom base_link", "wheels")], static, PlanProcess("wheels", "external")
    )
    process = start("static", plan, "static", "--ros-args", "-r", "__node:=frames2")
    process.until_says("150 edges on /tf_static")
    topic = "/fleet/r1/tf_static"
    (received,) = take(node, TFSubscription(node, static=True, topic=topic))
    transforms = decode(received.data)
    assert [(t.parent, t.child, t.xyz[0]) for t in transforms] == [
        ("base_link", f"frame_{n}", n) for n in range(150)
    ]
    assert 0 <= time.time_ns() - transforms[0].stamp_ns < 60e9
    assert until(lambda: [w.node for w in writers(node, topic)] == ["/fleet/r1/frames2"])
    (writer,) = writers(node, topic)
    assert writer.gid == received.gid
    assert (writer.durability, writer.type) == ("transient_local", "tf2_msgs/msg/TFMessage")


def test_joint_states_move_wheels_and_mimics_and_only_joints_describes(
    start: Make, node: Any, rover: Any
) -> None:
    process = start("joints", rover, "joints", "--ros-args", "-p", "publish_frequency:=10.0")
    process.until_says("4 edges on /tf, from /rover/joint_states, at most 10 Hz")
    assert described(node) == "<robot name='rover'/>"
    message = JointState(name=["left", "gripper", "right"], position=[0.7, math.nan, -1.2])
    message.header.stamp.sec, message.header.stamp.nanosec = 12, 34
    transforms = _answer(node, message)

    axle = Rotation.from_euler("xyz", [0.3, 0, 0])
    turned = {
        "left": (axle, 0.7),
        "right": (axle, -1.2),
        "follower": (Rotation.identity(), -2.0 * 0.7 + 0.5),
    }
    for name, (before, angle) in turned.items():
        expected = (before * Rotation.from_rotvec([0, angle, 0])).as_quat()
        assert angle_between(transforms[name].quat_xyzw, tuple(expected)) < 1e-7
    assert transforms["left"].xyz == (0.1, 0.2, 0.0)
    assert transforms["finger"].xyz == pytest.approx((0, 0.01 * (-2.0 * 0.7 + 0.5) + 0.002, 0))
    assert {t.stamp_ns for t in transforms.values()} == {12_000_000_034}


def test_a_parameter_of_another_type_is_refused_with_a_sentence(start: Make, rover: Any) -> None:
    process = start("joints", rover, "joints", "--ros-args", "-p", "publish_frequency:=fast")
    assert process.process.wait(UNTIL_S) == 1
    process.close()
    (line,) = process.errors
    assert "publish_frequency" in line


def test_the_description_is_latched_and_another_is_reported_once(
    start: Make, node: Any, write: Make
) -> None:
    process = start("static", write([], PlanProcess("static", "static")), "static")
    process.until_says("edge")
    assert described(node) == "<robot name='rover'/>"
    texts = ("rover", "stranger", "third")
    same, different = (
        latch(node, "/rover/robot_description", f"<robot name='{name}'/>") for name in texts[:2]
    )
    process.until_says("/test/of_the_test publishes another /rover/robot_description")
    different.publish(String(data=f"<robot name='{texts[2]}'/>"))
    time.sleep(0.5)
    assert process.output.count("another") == 1
    assert same


def test_processes_end_before_their_next_message_and_report_no_time_once(
    start: Make, edge: Make, write: Make
) -> None:
    """An interrupt ends them as silently whenever ``up`` does."""
    simulated = Simulation("fixed", 0.01)  # a message in 100 s
    kinds: tuple[ProcessKind, ...] = ("static", "joints", "simulate", "guard")
    processes = [PlanProcess(kind, kind, simulate=simulated) for kind in kinds]
    edges = [edge("map odom", "simulate"), edge("a b")]
    file = write(edges, *processes, clock="sim")
    running = [start(kind, file, kind) for kind in kinds]
    for publisher in running[:3]:
        publisher.until_says("edge")
    for publisher in running[2:]:
        publisher.until_says(
            "no time on /clock after 5 s: the plan's clock is sim, and nobody publis"
        )
    time.sleep(0.5)
    for publisher in running:
        code = publisher.end(signal.SIGTERM)
        publisher.close()
        assert (code, publisher.errors) == (0, [])
        assert publisher.output.count("/clock") == (publisher in running[2:])


def test_an_interrupt_during_the_start_ends_silently_too(start: Make, write: Make) -> None:
    file = write([], PlanProcess("static", "static"))
    process = start("static", file, "static", PYTHONVERBOSE="1")
    imports = ("import 'tfcompose.launcher.publishers.description'", "import 'rclpy'")
    end = time.monotonic() + UNTIL_S
    while not any(module in line for line in process.errors for module in imports):
        assert time.monotonic() < end, "it loads nothing"
        time.sleep(0.001)
    code = process.end(signal.SIGINT)
    process.close()
    assert code == 0
    assert "Traceback" not in "".join(process.errors)


def _answer(node: Any, message: Any) -> dict[str, SentTransform]:
    """Send a joint state until it is answered on /tf; return the answer by child frame."""
    subscription = TFSubscription(node, static=False)
    sender = node.create_publisher(JointState, "/rover/joint_states", 10)
    received: list[Received] = []

    def answered() -> bool:
        sender.publish(message)
        wait(node, [subscription], 0.2, Stop())
        received.extend(subscription.take())
        return bool(received)

    assert until(answered)
    return {transform.child: transform for transform in decode(received[0].data)}
