import os
import signal
import threading
import time
from typing import Any

import pytest
from sensor_msgs.msg import JointState

from tests.support.waiting import none_but, until
from tfcompose.foundation.signals import Stop
from tfcompose.tf.ros.environment import RosError
from tfcompose.tf.ros.graph import writers
from tfcompose.tf.ros.node import (
    JOINT_STATES,
    Subscription,
    TFPublisher,
    TFSubscription,
    open_node,
    wait,
)
from tfcompose.tf.ros.tf_codec import SentTransform, decode, encode

pytestmark = [pytest.mark.ros, pytest.mark.usefixtures("domain")]

ONE = SentTransform(1, "odom", "base", (1.0, 2.0, 3.0), (0.0, 0.0, 0.0, 1.0))
UNTIL_S = 60.0


def test_a_message_and_the_graph_name_the_same_publisher(node: Any) -> None:
    with open_node("one", "/rover") as first, open_node("two", "/rover") as second:
        subscription = TFSubscription(node, static=True)
        publishers = [TFPublisher(each, static=True) for each in (first, second)]
        for number, publisher in enumerate(publishers):
            publisher.publish(encode([SentTransform(number, "a", "b", ONE.xyz, ONE.quat_xyzw)]))
        received = _take(node, subscription, 2)
        names = ["/rover/one", "/rover/two"]  # known a moment after the messages
        assert until(lambda: [writer.node for writer in writers(node, "/tf_static")] == names)
        named = {writer.gid: writer for writer in writers(node, "/tf_static")}
        nodes_by_stamp = {
            decode(each.data)[0].stamp_ns: named[each.gid or b""].node for each in received
        }
    assert nodes_by_stamp == {0: "/rover/one", 1: "/rover/two"}
    assert {writer.durability for writer in named.values()} == {"transient_local"}
    assert {writer.reliability for writer in named.values()} == {"reliable"}
    assert {writer.type for writer in named.values()} == {"tf2_msgs/msg/TFMessage"}


@pytest.mark.parametrize(("static", "topic"), [(False, "/tf"), (True, "/tf_static")])
def test_publishers_and_readers_are_on_tf2s_topics(node: Any, topic: str, *, static: bool) -> None:
    assert TFPublisher(node, static=static).publisher.topic_name == topic
    assert TFSubscription(node, static=static).topic == topic


def test_take_returns_everything_in_order_and_then_nothing(node: Any) -> None:
    publisher, subscription = TFPublisher(node, static=False), TFSubscription(node, static=False)
    assert until(lambda: publisher.publisher.get_subscription_count() == 1)
    assert subscription.take() == []
    before = time.time_ns()
    for stamp in range(50):
        publisher.publish(encode([SentTransform(stamp, "a", "b", ONE.xyz, ONE.quat_xyzw)]))
    received = _take(node, subscription, 50)
    assert [decode(each.data)[0].stamp_ns for each in received] == list(range(50))
    assert [each.sequence for each in received] == list(
        range(received[0].sequence, received[0].sequence + 50)
    )
    assert all(before <= each.source_ns <= each.received_ns <= time.time_ns() for each in received)
    assert subscription.take() == []


def test_other_types_are_taken_as_bytes_too(node: Any) -> None:
    subscription = Subscription(node, JointState, "joint_states", JOINT_STATES)
    publisher = node.create_publisher(JointState, "/test/joint_states", 10)
    assert until(lambda: publisher.get_subscription_count() == 1)
    publisher.publish(JointState(name=["left"], position=[1.0]))
    assert b"left" in _take(node, subscription, 1)[0].data


def test_a_topic_of_ones_own_keeps_away_from_tf(node: Any) -> None:
    TFPublisher(node, static=False, topic="/private/tf")
    assert [writers(node, topic) != [] for topic in ("/private/tf", "/tf")] == [True, False]


def test_a_wait_without_messages_ends_in_time(node: Any) -> None:
    subscription = TFSubscription(node, static=False)
    start = time.monotonic()
    wait(node, [subscription], 0.05, Stop())
    assert 0.04 < time.monotonic() - start < 30


def test_a_signal_ends_a_wait_and_all_later_ones(node: Any) -> None:
    subscription = TFSubscription(node, static=False)
    with Stop() as stop:
        timer = threading.Timer(0.1, os.kill, (os.getpid(), signal.SIGTERM))
        timer.start()
        start = time.monotonic()
        wait(node, [subscription], 60.0, stop)
        assert stop.requested
        for _ in range(3):
            wait(node, [subscription], 60.0, stop)
        assert time.monotonic() - start < 30
        timer.join()


def test_a_signal_after_the_node_has_ended_does_no_harm(domain: object) -> None:
    assert domain
    stop = Stop()
    with open_node("brief", "/rover") as node:
        wait(node, [TFSubscription(node, static=False)], 0.0, stop)
    stop.request()
    assert stop.requested


def test_a_node_leaves_no_thread_and_offers_no_dead_service(
    domain: object,
) -> None:
    assert domain
    with open_node("quiet", "/rover") as node:
        assert node.get_service_names_and_types_by_node("quiet", "/rover") == []
        assert [topic for topic, _ in node.get_topic_names_and_types()] == ["/parameter_events"]
    threads = threading.enumerate()
    with open_node("again", "/rover"):
        pass
    assert none_but(threads)


@pytest.mark.parametrize(
    ("name", "args", "variables"),
    [
        ("not a name", [], {}),
        ("fine", ["-r", "no rule"], {}),
        ("fine", [], {"ROS_DOMAIN_ID": "many"}),
    ],
)
def test_what_ros_refuses_is_reported_in_one_sentence(
    monkeypatch: pytest.MonkeyPatch, name: str, args: list[str], variables: dict[str, str]
) -> None:
    for variable, value in variables.items():
        monkeypatch.setenv(variable, value)
    with (
        pytest.raises(RosError, match=r"^ROS cannot start a node: .+$"),
        open_node(name, "", args=args),
    ):
        pass


def _take(node: Any, subscription: Subscription, count: int) -> list[Any]:
    received: list[Any] = []
    end = time.monotonic() + UNTIL_S
    while len(received) < count and time.monotonic() < end:
        wait(node, [subscription], 1.0, Stop())
        received += subscription.take()
    assert len(received) == count
    return received
