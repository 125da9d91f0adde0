"""The listener with rclpy's futures, clocks, profiles and threads."""

import subprocess
import sys
import threading
from collections.abc import Iterator
from typing import Any

import pytest
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import QoSProfile
from rclpy.time import Time
from rosgraph_msgs.msg import Clock

from tests.support import processes
from tests.support.waiting import none_but, until
from tfcompose.foundation.geometry import Pose
from tfcompose.tf.ros.node import TFPublisher, open_node
from tfcompose.tf.ros.tf_codec import SentTransform, encode
from tfcompose.tf.tf2 import Buffer, TransformListener

pytestmark = [pytest.mark.ros, pytest.mark.usefixtures("domain")]

S = 1_000_000_000
UNIT = (0.0, 0.0, 0.0, 1.0)


@pytest.fixture
def other(domain: object) -> Iterator[Any]:
    assert domain
    with open_node("talks", "/test") as opened:
        yield opened


def one(x: float, stamp_ns: int, parent: str = "odom", child: str = "base_link") -> bytes:
    return encode([SentTransform(stamp_ns, parent, child, (x, 0.0, 0.0), UNIT)])


def test_an_executor_spins_until_the_transform_is_there(node: Any, other: Any) -> None:
    buffer = Buffer()
    listener = TransformListener(buffer, node)
    executor = SingleThreadedExecutor(context=node.context)
    executor.add_node(node)
    publisher = TFPublisher(other, static=False)
    assert until(lambda: publisher.publisher.get_subscription_count() == 1)
    future = buffer.wait_for_transform_async("odom", "base_link", Time(seconds=5))
    executor.spin_until_future_complete(future, timeout_sec=0.2)
    assert not future.done()
    for stamp in (4, 6):
        publisher.publish(one(float(stamp), stamp * S))
    executor.spin_until_future_complete(future, timeout_sec=60)
    assert future.result().transform.translation.x == 5.0
    listener.close()
    executor.shutdown()


def test_a_callback_that_awaits_lets_the_executor_hear_what_it_waits_for(
    node: Any, other: Any
) -> None:
    buffer = Buffer()
    listener = TransformListener(buffer, node)
    executor = SingleThreadedExecutor(context=node.context)
    executor.add_node(node)
    found: list[float] = []

    async def on_timer() -> None:
        timer.cancel()
        transform = await buffer.lookup_transform_async("odom", "base_link", Time(seconds=5))
        found.append(transform.transform.translation.x)

    timer = node.create_timer(0.01, on_timer)
    publisher = TFPublisher(other, static=False)
    assert until(lambda: publisher.publisher.get_subscription_count() == 1)

    def requested() -> bool:
        executor.spin_once(timeout_sec=0.05)
        return bool(buffer.on_insert)

    assert until(requested)
    publisher.publish(one(1.0, 4 * S))
    publisher.publish(one(2.0, 6 * S))

    def answered() -> bool:
        executor.spin_once(timeout_sec=0.05)
        return bool(found)

    assert until(answered)
    assert found == [1.5]
    listener.close()
    executor.shutdown()


def test_a_listener_of_its_own_follows_the_simulated_clock_and_says_when_it_goes_back(
    other: Any, capfd: pytest.CaptureFixture[str]
) -> None:
    buffer = Buffer()
    clock = other.create_publisher(Clock, "/clock", 1)
    publisher = TFPublisher(other, static=False)

    with TransformListener(buffer, use_sim_time=True) as listener:
        own = listener._ros.node.get_clock()

        def at(seconds: int) -> bool:
            clock.publish(Clock(clock=Time(seconds=seconds).to_msg()))
            return bool(own.now().nanoseconds == seconds * S)

        assert until(lambda: publisher.publisher.get_subscription_count() == 1)
        assert until(lambda: at(100))
        publisher.publish(one(1.0, 100 * S))
        assert until(lambda: buffer.can_transform("odom", "base_link", Time()))
        assert until(lambda: at(160))
        assert buffer.can_transform("odom", "base_link", Time()), "a jump forward forgets nothing"
        assert until(lambda: at(5))
        assert until(lambda: not buffer.can_transform("odom", "base_link", Time()))
        publisher.publish(one(2.0, 5 * S))
        assert until(lambda: buffer.can_transform("odom", "base_link", Time(seconds=5)))
    assert "back by 155.000 s" in capfd.readouterr().err


def test_a_node_with_use_sim_time_clears_the_buffer_that_it_was_given_to_once(domain: Any) -> None:
    """Both the buffer and the listener are told the node, as tf2_ros's programs do.

    Its parameter does the rest.
    """
    code = """
import rclpy, sys
from rclpy.time import Time
from tfcompose.tf.tf2 import Buffer, TransformListener
from tfcompose.foundation.geometry import Pose
rclpy.init(args=["--ros-args", "-p", "use_sim_time:=true"])
node = rclpy.create_node("asks")
buffer = Buffer(node=node)
listener = TransformListener(buffer, node)
print("up", flush=True)
while node.get_clock().now().nanoseconds != 100 * 10**9:
    rclpy.spin_once(node, timeout_sec=0.05)
buffer.set("odom", "base_link", Pose(), 100 * 10**9, static=False)
print("set", flush=True)
while buffer.can_transform("odom", "base_link", Time()):
    rclpy.spin_once(node, timeout_sec=0.05)
print("forgotten", flush=True)
rclpy.shutdown()
"""
    with (
        open_node("talks", "") as other,
        processes.start(
            [sys.executable, "-c", code],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            env=domain.environment,
        ) as process,
    ):
        assert process.stdout
        assert process.stderr
        clock = other.create_publisher(Clock, "/clock", 1)
        stop = threading.Event()
        seconds = 100

        def tick() -> None:
            while not stop.wait(0.05):
                clock.publish(Clock(clock=Time(seconds=seconds).to_msg()))

        thread = threading.Thread(target=tick)
        thread.start()
        try:
            assert [process.stdout.readline() for _ in range(2)] == ["up\n", "set\n"]
            seconds = 7
            assert process.stdout.readline() == "forgotten\n"
            assert process.wait(60) == 0
        finally:
            stop.set()
            thread.join()
            process.kill()
        assert process.stderr.read().count("time went back by 93.000 s") == 1


def test_a_listener_to_fixed_edges_alone_has_one_subscription(node: Any, other: Any) -> None:
    buffer = Buffer()
    with TransformListener(buffer, node, static_only=True, spin_thread=True):
        assert [
            len(node.get_subscriptions_info_by_topic(name)) for name in ("/tf", "/tf_static")
        ] == [0, 1]
        publisher = TFPublisher(other, static=True)
        publisher.publish(one(0.5, 0, "base_link", "laser"))
        assert (
            buffer.lookup_transform(
                "base_link", "laser", 0, timeout=60 * S
            ).transform.translation.x
            == 0.5
        )
    with TransformListener(buffer, static_only=True) as listener:
        own = listener._ros.node
        assert [
            len(own.get_subscriptions_info_by_topic(name)) for name in ("/tf", "/tf_static")
        ] == [0, 1]


@pytest.mark.parametrize("handed_over", [True, False])
def test_profiles_and_depths_are_those_that_were_requested(
    node: Any, *, handed_over: bool
) -> None:
    profile: Any = QoSProfile
    requested = profile(depth=7, reliability=2)  # best effort
    with TransformListener(
        Buffer(), node if handed_over else None, qos=requested, static_qos=5
    ) as listener:
        own = listener._ros.node
        moving, fixed = (
            own.get_subscriptions_info_by_topic(name)[0].qos_profile
            for name in ("/tf", "/tf_static")
        )
    assert moving.reliability.name == "BEST_EFFORT"
    assert (fixed.reliability.name, fixed.durability.name) == (
        "RELIABLE",
        "TRANSIENT_LOCAL",
    ), "still latched"


def test_a_thread_of_the_listeners_spins_the_entire_node_and_ends_with_it(
    node: Any, other: Any
) -> None:
    before, ticks = threading.enumerate(), []
    node.create_timer(0.01, lambda: ticks.append(1))
    buffer = Buffer()
    with TransformListener(buffer, node, spin_thread=True):
        publisher = TFPublisher(other, static=False)
        assert until(lambda: publisher.publisher.get_subscription_count() == 1)
        publisher.publish(one(1.0, S))
        assert (
            buffer.lookup_transform("odom", "base_link", 0, timeout=60 * S).transform.translation.x
            == 1.0
        )
        assert until(lambda: len(ticks) > 1)
    assert none_but(before)


def test_a_wait_of_half_a_second_ends_after_half_a_second_and_callbacks_of_tf_are_heard_meanwhile(
    node: Any, other: Any
) -> None:
    """The thread that waits is the only one, and nobody spins."""
    buffer = Buffer()
    with TransformListener(buffer, node):
        publisher = TFPublisher(other, static=False)
        assert until(lambda: publisher.publisher.get_subscription_count() == 1)
        timer = threading.Timer(0.1, lambda: publisher.publish(one(3.0, 9 * S)))
        timer.start()
        assert buffer.can_transform("odom", "base_link", Time(seconds=9), timeout=60 * S)
        timer.join()
        possible, why = buffer.can_transform(
            "odom", "base_link", Time(seconds=10), timeout=S // 2, return_debug_tuple=True
        )
        assert not possible
        assert "odom → base_link at 10.000000000 s " in why
    buffer.set("odom", "base_link", Pose(), 10 * S, static=False)
    assert buffer.can_transform("odom", "base_link", Time(seconds=10))
