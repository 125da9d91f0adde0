"""Listening to TF in a node: one that somebody else spins, or one of its own with a thread."""

from __future__ import annotations

import threading
from contextlib import ExitStack, suppress
from itertools import count
from typing import TYPE_CHECKING, Any

from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.clock import JumpThreshold
from rclpy.duration import Duration
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy

from tfcompose.ros.node import TF_READER, TF_STATIC_READER, open_node
from tfcompose.ros.stop import Stop
from tfcompose.ros.tf import TFSubscription, wait
from tfcompose.ros.typesupport import tf_message_type

if TYPE_CHECKING:
    from collections.abc import Callable

    from rclpy.node import Node

    #: Is given the bytes of each message, and whether it came on the static topic.
    Hear = Callable[[bytes, bool], None]

_numbers = count(1)


class GuestEar:
    """Subscriptions in a node that is handed over; its executor calls ``hear``, or ``poll`` does.

    With ``spin`` an executor in a thread of its own spins the whole node, as tf2_ros's listener does.
    """

    def __init__(self, node: Node, hear: Hear, topics: tuple[str, str], qos: tuple[Any, Any], *, spin: bool) -> None:
        self.node: Any = node
        self._hear = hear
        group = ReentrantCallbackGroup()  # another callback of the node may wait for what these bring
        self._subscriptions = [
            (self._subscribe(topic, profile, group, static=static), static)
            for topic, profile, static in (
                (topics[0], qos[0] or TF_READER, False),
                (topics[1], qos[1] or TF_STATIC_READER, True),
            )
        ]
        self._executor: Any = None
        if spin:
            self._executor = SingleThreadedExecutor(context=node.context)
            self._thread = threading.Thread(target=self._spin, name="tf listener", daemon=True)
            self._thread.start()

    def poll(self) -> None:
        """Take what has come and wait for nothing; for a caller who keeps the executor from doing it."""
        for subscription, static in self._subscriptions:
            with suppress(_rclpy.InvalidHandle), subscription.handle:
                while (taken := subscription.handle.take_message(subscription.msg_type, True)) is not None:  # noqa: FBT003 (rclpy's: as bytes)
                    self._hear(taken[0], static)

    def close(self) -> None:
        """End the thread, if there is one, and the subscriptions; the node stays."""
        if self._executor is not None:
            self._executor.shutdown()
            self._thread.join()
            self._executor = None
        while self._subscriptions:
            subscription, _ = self._subscriptions.pop()
            with suppress(_rclpy.InvalidHandle):
                self.node.destroy_subscription(subscription)

    def _subscribe(self, topic: str, qos: Any, group: ReentrantCallbackGroup, *, static: bool) -> Any:
        def callback(data: bytes) -> None:
            self._hear(data, static)

        return self.node.create_subscription(tf_message_type(), topic, callback, qos, callback_group=group, raw=True)

    def _spin(self) -> None:
        self._executor.add_node(self.node)
        with suppress(ExternalShutdownException):
            self._executor.spin()


class OwnEar:
    """A node of its own, in a context of its own, with a thread that waits for messages and calls ``hear``.

    Raises:
        RosError: if ROS cannot start a node.
    """

    def __init__(self, hear: Hear, topics: tuple[str, str]) -> None:
        self._hear = hear
        self._stop = Stop()
        self._stack = ExitStack()
        self.node = self._stack.enter_context(open_node(f"tfcompose_listener_{next(_numbers)}", ""))
        self._subscriptions = [
            (TFSubscription(self.node, static=static, topic=topic), static)
            for topic, static in zip(topics, (False, True), strict=True)
        ]
        self._thread = threading.Thread(target=self._listen, name="tf listener", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End the thread and the node."""
        self._stop.request()
        self._thread.join()
        self._subscriptions.clear()
        self._stack.close()

    def _listen(self) -> None:
        subscriptions = [subscription for subscription, _ in self._subscriptions]
        while not self._stop.requested:
            wait(self.node, subscriptions, None, self._stop)
            for subscription, static in self._subscriptions:
                for received in subscription.take():
                    self._hear(received.data, static)


def on_clock_jump(node: Node, callback: Callable[[], None]) -> Any:
    """Call back when the node's clock goes back, or becomes a simulator's or the system's; while the result lives."""
    threshold: Any = JumpThreshold
    return node.get_clock().create_jump_callback(
        threshold(min_forward=None, min_backward=Duration(nanoseconds=-1), on_clock_change=True),
        post_callback=lambda _: callback(),
    )
