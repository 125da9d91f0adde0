"""The time to stamp with: the system's, or a simulator's as it comes on /clock."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from rclpy.qos import DurabilityPolicy, ReliabilityPolicy
from rclpy.serialization import deserialize_message
from rosgraph_msgs.msg import Clock as ClockMessage

from tfcompose.ros.node import qos
from tfcompose.ros.tf import Subscription

if TYPE_CHECKING:
    from rclpy.node import Node

# rclcpp's ClockQoS: only the newest time counts.
_QOS = qos(1, DurabilityPolicy.VOLATILE, ReliabilityPolicy.BEST_EFFORT)


class SimClock:
    """The newest time on /clock. Wait for ``subscription``, then ask ``now_ns``."""

    def __init__(self, node: Node) -> None:
        self.subscription = Subscription(node, ClockMessage, "/clock", _QOS)
        self._now_ns: int | None = None

    def now_ns(self) -> int | None:
        """Return the newest simulated time in nanoseconds, or None before the first."""
        for received in self.subscription.take()[-1:]:
            clock = deserialize_message(received.data, ClockMessage).clock
            self._now_ns = clock.sec * 1_000_000_000 + clock.nanosec
        return self._now_ns


def wall_ns() -> int:
    """Return the system's time in nanoseconds since the epoch, as nodes without use_sim_time stamp."""
    return time.time_ns()
