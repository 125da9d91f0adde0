"""Time for stamps: the system's, or a simulator's from /clock."""

from __future__ import annotations

import struct
import time
from typing import TYPE_CHECKING

from rclpy.qos import DurabilityPolicy, ReliabilityPolicy
from rosgraph_msgs.msg import Clock as ClockMessage

from tfcompose.tf.ros.graph import publishing_nodes
from tfcompose.tf.ros.node import DEEP, Subscription, qos
from tfcompose.tf.ros.tf_codec import BIG_ENDIAN, LITTLE_ENDIAN

if TYPE_CHECKING:
    from collections.abc import Callable

    from rclpy.node import Node

#: Time in seconds after which a missing simulated time is reported. Without the report, a plan
#: with ``ros.clock: sim`` would silently do nothing.
CLOCK_AFTER_S = 5.0

_LENGTH = 12
_SECOND_NS = 1_000_000_000
# As rclcpp's ClockQoS: only the newest time matters.
_QOS = qos(1, DurabilityPolicy.VOLATILE, ReliabilityPolicy.BEST_EFFORT)


class DeepClockSubscription(Subscription):
    """A subscription to /clock that loses as few messages as possible."""

    def __init__(self, node: Node) -> None:
        profile = qos(DEEP, DurabilityPolicy.VOLATILE, ReliabilityPolicy.BEST_EFFORT)
        super().__init__(node, ClockMessage, "/clock", profile)


class SimClock:
    """The newest time on /clock. Wait for ``subscription``, then call ``now_ns``."""

    def __init__(self, node: Node) -> None:
        self.subscription = Subscription(node, ClockMessage, "/clock", _QOS)
        self._now_ns: int | None = None

    def now_ns(self) -> int | None:
        """Return the newest simulated time in nanoseconds, None before the first.

        Messages that are not a time are skipped.
        """
        for received in self.subscription.take():
            read_ns = read_clock(received.data)
            self._now_ns = self._now_ns if read_ns is None else read_ns
        return self._now_ns


class StampClock:
    """Time for messages without a stamp: their arrival, or simulated time.

    It subscribes to /clock only when the first such message arrives. ``say`` receives lines for
    the user.
    """

    def __init__(self, node: Node, say: Callable[[str], None], *, sim: bool) -> None:
        self._node, self._say, self._sim = node, say, sim
        self._clock: SimClock | None = None
        self._due = 0.0
        self.is_waiting = False

    def now_ns(self, received_ns: int) -> int | None:
        """Return the time in ns for a message with this arrival, None while no time is known."""
        if not self._sim:
            return received_ns
        if self._clock is None:
            self._clock = SimClock(self._node)
            self._due, self.is_waiting = time.monotonic() + CLOCK_AFTER_S, True
        return self._clock.now_ns()

    def check(self) -> None:
        """Report after some seconds that no time arrives."""
        if (
            self.is_waiting
            and self._clock
            and (self._clock.now_ns() is not None or time.monotonic() > self._due)
        ):
            self.is_waiting = False
            if self._clock.now_ns() is None:
                self._say(f"joint states have no time of their own, and {no_clock(self._node)}")


class ClockWatch:
    """Waits for the first message on /clock, if the plan uses simulated time.

    Afterwards ``check`` costs nothing.
    """

    def __init__(self, node: Node, say: Callable[[str], None], *, sim: bool) -> None:
        self._node, self._say = node, say
        self._due = time.monotonic() + CLOCK_AFTER_S
        self._clock = SimClock(node) if sim else None

    def check(self) -> None:
        """Report after some seconds that no time has arrived, and which node should publish it."""
        if self._clock is None or (self._clock.now_ns() is None and time.monotonic() < self._due):
            return
        if self._clock.now_ns() is None:
            self._say(no_clock(self._node))
        self._node.destroy_subscription(self._clock.subscription.subscription)
        self._clock = None


def no_clock(node: Node) -> str:
    """Return the sentence that no simulated time has arrived, with the publishers of /clock."""
    names = publishing_nodes(node, "/clock")
    who = (
        f"{', '.join(names)} publishes it and has sent nothing" if names else "nobody publishes it"
    )
    return f"no time on /clock after {CLOCK_AFTER_S:g} s: the plan's clock is sim, and {who}"


def read_clock(data: bytes) -> int | None:
    """Return the time of a rosgraph_msgs/Clock in nanoseconds, None for other bytes.

    Layout (OMG CDR): four bytes of header, int32 seconds, uint32 nanoseconds.
    """
    if len(data) < _LENGTH or data[:2] not in {LITTLE_ENDIAN[:2], BIG_ENDIAN[:2]}:
        return None
    seconds, nanoseconds = struct.unpack_from("<iI" if data[1] else ">iI", data, 4)
    return int(seconds) * _SECOND_NS + int(nanoseconds) if nanoseconds < _SECOND_NS else None


def wall_ns() -> int:
    """Return system time in nanoseconds since the epoch, the stamp without simulated time."""
    return time.time_ns()
