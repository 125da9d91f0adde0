"""The time to stamp with: the system's, or a simulator's as it comes on /clock."""

from __future__ import annotations

import struct
import time
from typing import TYPE_CHECKING

from rclpy.qos import DurabilityPolicy, ReliabilityPolicy
from rosgraph_msgs.msg import Clock as ClockMessage

from tfcompose.ros.node import Subscription, qos
from tfcompose.ros.tf_codec import BIG_ENDIAN, LITTLE_ENDIAN

if TYPE_CHECKING:
    from rclpy.node import Node

_LENGTH = 12
_SECOND_NS = 1_000_000_000
# rclcpp's ClockQoS: only the newest time counts.
_QOS = qos(1, DurabilityPolicy.VOLATILE, ReliabilityPolicy.BEST_EFFORT)


class SimClock:
    """The newest time on /clock. Wait for ``subscription``, then ask ``now_ns``."""

    def __init__(self, node: Node) -> None:
        self.subscription = Subscription(node, ClockMessage, "/clock", _QOS)
        self._now_ns: int | None = None

    def now_ns(self) -> int | None:
        """Return the newest simulated time in nanoseconds, or None before the first; what is no time is left out."""
        for received in self.subscription.take():
            read_ns = read_clock(received.data)
            self._now_ns = self._now_ns if read_ns is None else read_ns
        return self._now_ns


def read_clock(data: bytes) -> int | None:
    """Return the time of a rosgraph_msgs/Clock in nanoseconds, or None if the bytes are none.

    Layout (OMG CDR): four bytes of header, int32 seconds, uint32 nanoseconds.
    """
    if len(data) < _LENGTH or data[:2] not in {LITTLE_ENDIAN[:2], BIG_ENDIAN[:2]}:
        return None
    seconds, nanoseconds = struct.unpack_from("<iI" if data[1] else ">iI", data, 4)
    return int(seconds) * _SECOND_NS + int(nanoseconds) if nanoseconds < _SECOND_NS else None


def wall_ns() -> int:
    """Return the system's time in nanoseconds since the epoch, as nodes without use_sim_time stamp."""
    return time.time_ns()
