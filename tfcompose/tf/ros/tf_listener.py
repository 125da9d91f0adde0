"""Listening to TF in a node that the program spins, or in a private node with a thread."""

from __future__ import annotations

import threading
from contextlib import ExitStack, suppress
from importlib.util import find_spec
from itertools import count
from typing import TYPE_CHECKING, Any, NamedTuple

import geometry_msgs.msg  # noqa: F401 (a program that listens gets its messages: tf2.messages looks whether it is loaded)
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.clock import JumpThreshold
from rclpy.duration import Duration
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy
from rclpy.time import Time

from tfcompose.foundation.signals import Stop
from tfcompose.tf.ros.clock import SimClock
from tfcompose.tf.ros.node import (
    TF_READER,
    TF_STATIC_READER,
    Subscription,
    open_node,
    profile_of,
    wait,
)
from tfcompose.tf.ros.typesupport import tf_message_type

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rclpy.node import Node
    from rclpy.qos import QoSProfile

    #: Called with the bytes of each message, and whether it arrived on the static topic.
    OnMessage = Callable[[bytes, bool], None]

_numbers = count(1)


class TransformTopic(NamedTuple):
    """A topic of fixed or of moving edges to listen to."""

    name: str
    static: bool
    #: rclpy's profile, a depth, or None for tf2's.
    qos: Any

    @property
    def profile(self) -> QoSProfile:
        """The profile for the subscription."""
        return profile_of(self.qos, TF_STATIC_READER if self.static else TF_READER)


class NodeListener:
    """Subscriptions in the caller's node.

    The node's executor calls ``on_message``, or ``poll`` does. ``spin``: an executor in a separate
    thread spins the entire node, as tf2_ros's listener does.
    """

    def __init__(
        self, node: Node, on_message: OnMessage, topics: Sequence[TransformTopic], *, spin: bool
    ) -> None:
        self.node: Any = node
        self._on_message = on_message
        group = (
            ReentrantCallbackGroup()
        )  # another callback of the node may wait for these messages
        self._subscriptions = [(self._subscribe(topic, group), topic.static) for topic in topics]
        self._executor: Any = None
        if spin:
            self._executor = SingleThreadedExecutor(context=node.context)
            self._thread = threading.Thread(target=self._spin, name="tf listener", daemon=True)
            self._thread.start()

    def poll(self) -> None:
        """Take pending messages without blocking, for a caller that blocks the executor."""
        for subscription, static in self._subscriptions:
            with suppress(_rclpy.InvalidHandle), subscription.handle:
                while (
                    taken := subscription.handle.take_message(subscription.msg_type, True)  # noqa: FBT003
                ) is not None:
                    self._on_message(taken[0], static)

    def close(self) -> None:
        """Stop the thread, if there is one, and the subscriptions. The node stays."""
        if self._executor is not None:
            self._executor.shutdown()
            self._thread.join()
            self._executor = None
        while self._subscriptions:
            subscription, _ = self._subscriptions.pop()
            with suppress(_rclpy.InvalidHandle):
                self.node.destroy_subscription(subscription)

    def _subscribe(self, topic: TransformTopic, group: ReentrantCallbackGroup) -> Any:
        def callback(data: bytes) -> None:
            self._on_message(data, topic.static)

        return self.node.create_subscription(
            tf_message_type(), topic.name, callback, topic.profile, callback_group=group, raw=True
        )

    def _spin(self) -> None:
        self._executor.add_node(self.node)
        with suppress(ExternalShutdownException):
            self._executor.spin()


class ThreadListener:
    """A node in its own context, with a thread that calls ``on_message``.

    ``use_sim_time``: the node's clock follows /clock.

    Raises:
        RosError: if ROS cannot start a node.
    """

    def __init__(
        self, on_message: OnMessage, topics: Sequence[TransformTopic], *, use_sim_time: bool
    ) -> None:
        self._on_message = on_message
        self._stop = Stop()
        self._stack = ExitStack()
        self.node = self._stack.enter_context(
            open_node(f"tfcompose_listener_{next(_numbers)}", "")
        )
        self._subscriptions = [
            (Subscription(self.node, tf_message_type(), topic.name, topic.profile), topic.static)
            for topic in topics
        ]
        self._clock = SimClock(self.node) if use_sim_time else None
        self._thread = threading.Thread(target=self._run, name="tf listener", daemon=True)

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def close(self) -> None:
        """Stop the thread and the node."""
        self._stop.request()
        self._thread.join()
        self._subscriptions.clear()
        self._clock = None
        self._stack.close()

    def _run(self) -> None:
        awaited: list[Subscription] = [subscription for subscription, _ in self._subscriptions]
        if self._clock:
            awaited.append(self._clock.subscription)
        while not self._stop.requested:
            wait(self.node, awaited, None, self._stop)
            self._follow()
            for subscription, static in self._subscriptions:
                for received in subscription.take():
                    self._on_message(received.data, static)

    def _follow(self) -> None:
        """Set the node's clock to simulated time, which notifies observers of jumps."""
        now_ns = self._clock.now_ns() if self._clock else None
        if now_ns is not None:
            clock: Any = self.node.get_clock()
            if not clock.ros_time_is_active:
                clock._set_ros_time_is_active(True)  # noqa: FBT003, SLF001 (what the parameter use_sim_time does)
            clock.set_ros_time_override(Time(nanoseconds=now_ns, clock_type=clock.clock_type))


def on_clock_jump(node: Node, callback: Callable[[], object]) -> Any:
    """Call back when the node's clock goes back, or switches between simulated and system time.

    This ends when the result is deleted. The threshold is that of tf2_ros's ``Buffer`` in C++: any
    step back counts, and no step forward.
    """
    log: Any = node

    def jumped(jump: Any) -> None:
        back_s = -jump.delta.nanoseconds / 1e9
        why = (
            f"time went back by {back_s:.3f} s"
            if back_s > 0
            else "the clock changed to or from simulated time"
        )
        log.get_logger().warning(f"{why}: the TF buffer forgets all moving edges")
        callback()

    threshold: Any = JumpThreshold
    return node.get_clock().create_jump_callback(
        threshold(min_forward=None, min_backward=Duration(nanoseconds=-1), on_clock_change=True),
        post_callback=jumped,
    )


def offer_frames(node: Node, text: Callable[[], str]) -> Any:
    """Offer the service ``tf2_frames``, which answers with the text.

    Return the service, None if tf2_msgs is not installed.
    """
    if find_spec("tf2_msgs") is None:
        return None
    from tf2_msgs.srv import FrameGraph  # noqa: PLC0415 (there is none with the wheels from PyPI)

    def answer(_: object, response: Any) -> Any:
        response.frame_yaml = text()
        return response

    return node.create_service(FrameGraph, "tf2_frames", answer)
