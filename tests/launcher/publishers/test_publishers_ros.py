"""The publishing processes as they run: real processes, heard by a node of the test."""

import math
import signal
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import pairwise, repeat
from statistics import median
from typing import Any, Literal

import pytest
from rclpy.serialization import deserialize_message
from rosgraph_msgs.msg import Clock
from scipy.spatial.transform import Rotation
from sensor_msgs.msg import JointState
from std_msgs.msg import String

from tests.support.waiting import until
from tfcompose.foundation.geometry import Pose, angle_between, normalised, quat_from_rpy
from tfcompose.foundation.signals import Stop
from tfcompose.model.plan import PlanJoint, PlanProcess, Simulation, Sweep
from tfcompose.tf.ros.graph import writers
from tfcompose.tf.ros.node import (
    JOINT_STATES,
    LATCHED,
    Received,
    Subscription,
    TFSubscription,
    latch,
    open_node,
    wait,
)
from tfcompose.tf.ros.tf_codec import SentTransform, decode

pytestmark = pytest.mark.ros

UNTIL_S = 30.0
Y = (0.0, 1.0, 0.0)


@dataclass
class Listeners:
    """A node of the test that hears what processes say."""

    node: Any

    def tf(
        self, count: int, *, static: bool = False
    ) -> list[tuple[Received, list[SentTransform]]]:
        """Return the next messages, at least ``count`` of them."""
        return [
            (each, decode(each.data))
            for each in take(self.node, TFSubscription(self.node, static=static), count)
        ]


def take(node: Any, subscription: Subscription, count: int) -> list[Received]:
    received: list[Received] = []
    end = time.monotonic() + UNTIL_S
    while len(received) < count and time.monotonic() < end:
        wait(node, [subscription], 1.0, Stop())
        received += subscription.take()
    assert len(received) >= count
    return received


@pytest.fixture
def listeners(domain: object) -> Iterator[Listeners]:
    assert domain
    with open_node("ears", "/test") as node:
        yield Listeners(node)


@pytest.fixture
def rover(edge: Callable[..., Any], write: Callable[..., Any]) -> Any:
    """A robot with two wheels, a mimic of the left one, and a gripper with a mimic of that."""
    axle = Pose((0.1, 0.2, 0.0), quat_from_rpy(0.3, 0.0, 0.0))
    moving = [
        edge(
            "base finger",
            "joints",
            None,
            PlanJoint("finger", "prismatic", Y, "follower", 0.01, 0.002),
        ),
        edge(
            "base follower",
            "joints",
            None,
            PlanJoint("follower", "continuous", Y, "left", -2.0, 0.5),
        ),
        edge("base left", "joints", axle, PlanJoint("left", "continuous", Y)),
        edge("base right", "joints", axle, PlanJoint("right", "revolute", Y)),
    ]
    return write(moving, PlanProcess("joints", "joints"))


def test_a_late_joiner_gets_all_fixed_edges_in_one_message(
    start: Callable[..., Any],
    listeners: Listeners,
    edge: Callable[..., Any],
    write: Callable[..., Any],
) -> None:
    edges = [edge(f"base_link frame_{n}", "static", Pose((n, 0.0, 0.0))) for n in range(150)]
    other = [edge("odom base_link", "wheels")]
    both = PlanProcess("static", "static"), PlanProcess("wheels", "external")
    process = start("static", write(edges + other, *both), "static")
    process.until_says("150 edges on /tf_static")
    ((received, transforms),) = listeners.tf(1, static=True)
    assert [(t.parent, t.child, t.xyz[0]) for t in transforms] == [
        ("base_link", f"frame_{n}", n) for n in range(150)
    ]
    assert 0 <= time.time_ns() - transforms[0].stamp_ns < 60e9
    assert until(
        lambda: [w.node for w in writers(listeners.node, "/tf_static")] == ["/rover/static"]
    )
    (writer,) = writers(listeners.node, "/tf_static")
    assert writer.gid == received.gid
    assert (writer.durability, writer.type) == ("transient_local", "tf2_msgs/msg/TFMessage")


def test_joint_states_move_the_wheels_and_what_mimics_them(
    start: Callable[..., Any], listeners: Listeners, rover: Any
) -> None:
    start("joints", rover, "joints").until_says("4 edges on /tf, from /rover/joint_states")
    subscription = TFSubscription(listeners.node, static=False)
    message = JointState(name=["left", "gripper", "right"], position=[0.7, math.nan, -1.2])
    message.header.stamp.sec, message.header.stamp.nanosec = 12, 34
    found = _answer(listeners, subscription, message)

    axle = Rotation.from_euler("xyz", [0.3, 0, 0])
    turned = {
        "left": (axle, 0.7),
        "right": (axle, -1.2),
        "follower": (Rotation.identity(), -2.0 * 0.7 + 0.5),
    }
    for name, (before, angle) in turned.items():
        expected = (before * Rotation.from_rotvec([0, angle, 0])).as_quat()
        assert angle_between(found[name].quat_xyzw, tuple(expected)) < 1e-7
    assert found["left"].xyz == (0.1, 0.2, 0.0)
    assert found["finger"].xyz == pytest.approx((0, 0.01 * (-2.0 * 0.7 + 0.5) + 0.002, 0))
    assert {t.stamp_ns for t in found.values()} == {12_000_000_034}


def test_joints_that_no_joint_state_speaks_of_are_named_once_with_who_sends_the_others(
    start: Callable[..., Any], listeners: Listeners, rover: Any
) -> None:
    right = JointState(name=["right"], position=[1.0])
    publisher = listeners.node.create_publisher(JointState, "/rover/joint_states", 10)
    process = start("joints", rover, "joints")

    def has_reported() -> bool:
        publisher.publish(right)  # from before its start on, so that it is heard in its first 5 s
        return until(lambda: "no joint state" in process.output, 0.1)

    assert until(has_reported)
    process.until_says("no joint state after 5 s for left: /rover/joint_states comes from ")
    assert process.output.count("no joint state") == 1


def test_publish_frequency_is_reported(start: Callable[..., Any], rover: Any) -> None:
    process = start(
        "joints",
        rover,
        "joints",
        "--ros-args",
        "-p",
        "publish_frequency:=10.0",
    )
    process.until_says("4 edges on /tf, from /rover/joint_states, at most 10 Hz")


def test_a_parameter_of_another_type_is_refused_with_a_sentence(
    start: Callable[..., Any], rover: Any
) -> None:
    process = start(
        "joints",
        rover,
        "joints",
        "--ros-args",
        "-p",
        "publish_frequency:=fast",
    )
    assert process.process.wait(UNTIL_S) == 1
    process.close()
    (line,) = process.errors
    assert "publish_frequency" in line


def test_another_description_changes_nothing_and_is_reported_with_its_publisher(
    start: Callable[..., Any], listeners: Listeners, write: Callable[..., Any]
) -> None:
    process = start("static", write([], PlanProcess("static", "static")), "static")
    process.until_says("edge")
    same = latch(listeners.node, "/rover/robot_description", "<robot name='rover'/>")
    other = latch(listeners.node, "/rover/robot_description", "<robot name='stranger'/>")
    process.until_says("/test/ears publishes another /rover/robot_description: ")
    other.publish(String(data="<robot name='third'/>"))
    take_for(
        listeners.node,
        Subscription(listeners.node, String, "/rover/robot_description", LATCHED),
        0.5,
    )
    assert process.output.count("another") == 1
    assert same


@pytest.mark.parametrize("name", ["static", "joints"])
def test_the_description_is_latched(
    start: Callable[..., Any],
    listeners: Listeners,
    write: Callable[..., Any],
    name: Literal["static", "joints"],
) -> None:
    start(name, write([], PlanProcess(name, name)), name).until_says("edge")
    subscription = Subscription(listeners.node, String, "/rover/robot_description", LATCHED)
    (received,) = take(listeners.node, subscription, 1)
    assert deserialize_message(received.data, String).data == "<robot name='rover'/>"


def test_the_description_is_left_to_the_static_process_where_there_is_one(
    start: Callable[..., Any],
    listeners: Listeners,
    edge: Callable[..., Any],
    write: Callable[..., Any],
) -> None:
    file = write([edge("a b")], PlanProcess("static", "static"), PlanProcess("joints", "joints"))
    start("joints", file, "joints").until_says("0 edges on /tf")
    subscription = Subscription(listeners.node, String, "/rover/robot_description", LATCHED)
    assert take_for(listeners.node, subscription, 0.5) == []
    start("static", file, "static").until_says("1 edge on /tf_static")
    assert len(take(listeners.node, subscription, 1)) == 1


def test_the_rate_does_not_drift(
    start: Callable[..., Any],
    listeners: Listeners,
    edge: Callable[..., Any],
    write: Callable[..., Any],
) -> None:
    pose = Pose((1.0, 2.0, 3.0), normalised((0.0, 0.0, 1.0, 1.0)))
    process = PlanProcess("map", "simulate", simulate=Simulation("fixed", 25.0, pose=pose))
    start("simulate", write([edge("map odom", "map")], process), "map").until_says("simulated")
    transforms = [transform for _, (transform,) in listeners.tf(51)]
    assert {(t.parent, t.child, t.xyz, t.quat_xyzw) for t in transforms} == {
        ("map", "odom", pose.xyz, pose.quat_xyzw)
    }
    # A late tick moves no later one: most stamps lie near whole periods from each other, however
    # busy the machine is.
    periods = [transform.stamp_ns / 40_000_000 for transform in transforms]
    off = min(median(abs(math.remainder(a - b, 1.0)) for a in periods) for b in periods)
    assert off < 0.15, "0.25 is what drifting stamps give"
    assert periods[50] - periods[0] >= 49
    assert median(b - a for a, b in pairwise(periods)) < 1.5, "most ticks come"


def test_swept_joints_move_within_their_limits_and_the_others_stay(
    start: Callable[..., Any], listeners: Listeners, write: Callable[..., Any]
) -> None:
    simulated = Simulation(
        "joints", 50.0, joints={"lift": 0.2, "grip": 0.5}, sweep={"lift": Sweep(1.0, 0.1, 0.5)}
    )
    file = write([], PlanProcess("wheels", "simulate", simulate=simulated))
    start("simulate", file, "wheels").until_says(
        "2 joints on /rover/joint_states, simulated at 50 Hz"
    )
    subscription = Subscription(listeners.node, JointState, "/rover/joint_states", JOINT_STATES)
    messages = [
        deserialize_message(each.data, JointState)
        for each in take(listeners.node, subscription, 75)
    ]
    assert {tuple(message.name) for message in messages} == {("lift", "grip")}
    assert {message.position[1] for message in messages} == {0.5}
    # Later messages are where a sine of this period is that goes through the first one's place,
    # upwards or downwards.
    stamps_s = [
        message.header.stamp.sec + message.header.stamp.nanosec / 1e9 for message in messages
    ]
    lifts = [message.position[0] for message in messages]
    rotation = math.asin((lifts[0] - 0.3) / 0.2)
    by_direction = [
        [0.3 + 0.2 * math.sin(first + math.tau * (stamp_s - stamps_s[0])) for stamp_s in stamps_s]
        for first in (rotation, math.pi - rotation)
    ]
    assert any(lifts == pytest.approx(expected, abs=0.01) for expected in by_direction)


def test_simulated_time_comes_from_the_clock_topic(
    start: Callable[..., Any],
    listeners: Listeners,
    edge: Callable[..., Any],
    write: Callable[..., Any],
) -> None:
    circle = Simulation("circle", 10.0, radius=1.0, speed=1.0)
    process = PlanProcess("wheels", "simulate", simulate=circle)
    start(
        "simulate",
        write([edge("odom base", "wheels")], process, clock="sim"),
        "wheels",
    )
    subscription = TFSubscription(listeners.node, static=False)
    clock = listeners.node.create_publisher(Clock, "/clock", 10)
    # Whoever has just started may hear the clock before somebody hears it on /tf, and answers each
    # time once.
    _repeat(
        listeners,
        subscription,
        (partial(clock.publish, _time(seconds)) for seconds in range(1000, 2000)),
    )
    for case, seconds in enumerate((5.0, 5.03, 5.1, 5.3, 1.0, 1.1)):
        send = partial(clock.publish, _time(seconds))
        if case == 1:  # within a period
            send()
            assert take_for(listeners.node, subscription, 0.3) == []
            continue
        found = _repeat(listeners, subscription, repeat(send), round(seconds * 1e9))
        expected = seconds - (5.0 if case < 4 else 1.0)  # 1.0 is a simulator that starts anew
        assert math.atan2(found.xyz[1], found.xyz[0]) == pytest.approx(expected)


def test_that_simulated_time_does_not_come_is_reported_once(
    start: Callable[..., Any],
    listeners: Listeners,
    edge: Callable[..., Any],
    write: Callable[..., Any],
) -> None:
    process = PlanProcess("guard", "guard")
    started = start("guard", write([edge("odom base", "guard")], process, clock="sim"), "guard")
    started.until_says(
        "no time on /clock after 5 s: the plan's clock is sim, and nobody publishes it\n"
    )
    take_for(listeners.node, TFSubscription(listeners.node, static=False), 1.0)
    assert started.output.count("/clock") == 1


@pytest.mark.parametrize(("clock", "number"), [("wall", signal.SIGINT), ("sim", signal.SIGTERM)])
def test_every_process_ends_before_its_next_message_and_silently(
    start: Callable[..., Any],
    edge: Callable[..., Any],
    write: Callable[..., Any],
    clock: str,
    number: int,
) -> None:
    simulated = Simulation("fixed", 0.01)  # a message in 100 s
    processes = [PlanProcess(k, k, simulate=simulated) for k in ("static", "joints", "simulate")]
    file = write([edge("map odom", "simulate"), edge("a b")], *processes, clock=clock)

    running = [start(process.kind, file, process.name) for process in processes]
    for each in running:
        each.until_says("edge")
    for each in running:
        code = each.end(number)
        each.close()
        assert (code, each.errors) == (0, [])


def test_an_interrupt_during_the_start_ends_silently_too(
    start: Callable[..., Any], write: Callable[..., Any]
) -> None:
    file = write([], PlanProcess("static", "static"))
    process = start("static", file, "static", PYTHONVERBOSE="1")
    imports = ("import 'tfcompose.launcher.publishers.description'", "import 'rclpy'")
    end = time.monotonic() + UNTIL_S
    while not any(one in line for line in process.errors for one in imports):
        assert time.monotonic() < end, "it loads nothing"
        time.sleep(0.001)
    code = process.end(signal.SIGINT)
    process.close()
    assert code == 0
    assert "Traceback" not in "".join(process.errors)


def test_a_node_is_called_as_the_plan_says_and_its_topics_move_with_it(
    start: Callable[..., Any],
    listeners: Listeners,
    edge: Callable[..., Any],
    write: Callable[..., Any],
) -> None:
    process = PlanProcess(
        "static", "static", nodes=("/fleet/r1/frames",), remap={"/tf_static": "tf_static"}
    )
    start(
        "static",
        write([edge("a b")], process),
        "static",
        "--ros-args",
        "-r",
        "__node:=frames2",
    )
    assert until(
        lambda: (
            [w.node for w in writers(listeners.node, "/fleet/r1/tf_static")]
            == ["/fleet/r1/frames2"]
        )
    )


def take_for(node: Any, subscription: Subscription, seconds: float) -> list[Received]:
    received: list[Received] = []
    end = time.monotonic() + seconds
    while (left := end - time.monotonic()) > 0:
        wait(node, [subscription], left, Stop())
        received += subscription.take()
    return received


def _time(seconds: float) -> Clock:
    message = Clock()
    message.clock.sec, message.clock.nanosec = divmod(round(seconds * 1e9), 1_000_000_000)
    return message


def _repeat(
    listeners: Listeners,
    subscription: Subscription,
    sends: Iterable[Callable[[], None]],
    stamp_ns: int | None = None,
) -> SentTransform:
    """Send until something comes on /tf, with that stamp: best effort may lose messages."""
    end = time.monotonic() + UNTIL_S
    for send in sends:
        send()
        wait(listeners.node, [subscription], 0.2, Stop())
        for received in subscription.take():
            (transform,) = decode(received.data)
            if stamp_ns in (None, transform.stamp_ns):
                return transform
        if time.monotonic() > end:
            break
    raise AssertionError("nothing came on /tf")


def _answer(
    listeners: Listeners, subscription: Subscription, message: Any, publisher: Any = None
) -> dict[str, SentTransform]:
    """Send a joint state until it is answered on /tf; return the answer by child frame."""
    sender = publisher or listeners.node.create_publisher(JointState, "/rover/joint_states", 10)
    end = time.monotonic() + UNTIL_S
    while time.monotonic() < end:
        sender.publish(message)
        wait(listeners.node, [subscription], 0.2, Stop())
        for received in subscription.take():
            take_for(listeners.node, subscription, 0.2)
            return {transform.child: transform for transform in decode(received.data)}
    raise AssertionError("no answer on /tf")
