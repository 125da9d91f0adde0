"""What the joints process does: joint states become transforms, and what stays away is named."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from tfcompose.ros.clock import SimClock
from tfcompose.ros.graph import writers
from tfcompose.ros.joint_states import JointStateSubscription
from tfcompose.ros.node import TFPublisher, open_node, parameter, wait
from tfcompose.run.clock_watch import CLOCK_AFTER_S, no_clock
from tfcompose.run.notify import ready
from tfcompose.run.own import count, say
from tfcompose.run.publishing.description import CHECK_EVERY_S, Description
from tfcompose.run.publishing.joint_mover import JointMover, PublishOptions

if TYPE_CHECKING:
    from rclpy.node import Node

    from tfcompose.ros.stop import Stop
    from tfcompose.run.own import Own

MISSING_AFTER_S = 5.0
_NAMED_AT_MOST = 8


def joints(own: Own, stop: Stop) -> None:
    """Publish the moving edges of each message on ``joint_states``, with its stamp, and latch the description."""
    with open_node(own.node_name, own.namespace, args=own.ros_args) as node:
        options = PublishOptions(
            parameter(node, "publish_frequency", 0.0), parameter(node, "ignore_timestamp", default=False)
        )
        clock = _Clock(own, node)
        mover = JointMover(own.edges, say, clock.now_ns, options)
        publisher = TFPublisher(node, static=False)
        description = Description(own, node)
        states = JointStateSubscription(node)
        at_most = f", at most {options.publish_frequency:g} Hz" if options.publish_frequency else ""
        say(f"{count(len(mover), 'edge')} on /tf, from {states.topic}{at_most}")
        ready()
        missing = _Missing(node, mover, states.topic)
        while not stop.requested:
            is_waiting = missing.is_waiting or clock.is_waiting or description.is_waiting
            wait(node, [states, description.subscription], CHECK_EVERY_S if is_waiting else None, stop)
            for received in states.take():
                message = mover.answer(received.data, received.received_ns)
                if message is not None:
                    publisher.publish(message)
            description.check()
            missing.check()
            clock.check()


class _Clock:
    """The time for a message that has none: its arrival, or simulated time, which is asked for only then."""

    def __init__(self, own: Own, node: Node) -> None:
        self._node = node
        self._sim = own.plan.ros.clock == "sim"
        self._clock: SimClock | None = None
        self._due = 0.0
        self.is_waiting = False

    def now_ns(self, received_ns: int) -> int | None:
        if not self._sim:
            return received_ns
        if self._clock is None:
            self._clock = SimClock(self._node)
            self._due, self.is_waiting = time.monotonic() + CLOCK_AFTER_S, True
        return self._clock.now_ns()

    def check(self) -> None:
        """Say after some seconds that the time does not come."""
        if self.is_waiting and self._clock and (self._clock.now_ns() is not None or time.monotonic() > self._due):
            self.is_waiting = False
            if self._clock.now_ns() is None:
                say(f"joint states have no time of their own, and {no_clock(self._node)}")


class _Missing:
    """Names once, after some seconds, the joints that no joint state speaks of."""

    def __init__(self, node: Node, mover: JointMover, topic: str) -> None:
        self._node, self._mover, self._topic = node, mover, topic
        self._due = time.monotonic() + MISSING_AFTER_S
        self.is_waiting = len(mover) > 0

    def check(self) -> None:
        if not self.is_waiting or time.monotonic() < self._due:
            return
        self.is_waiting = False
        names = self._mover.missing
        if names:
            more = f" and {len(names) - _NAMED_AT_MOST} more" if len(names) > _NAMED_AT_MOST else ""
            say(
                f"no joint state after {MISSING_AFTER_S:g} s for {', '.join(names[:_NAMED_AT_MOST])}{more}:"
                f" {self._senders()}"
            )

    def _senders(self) -> str:
        names = sorted({writer.node for writer in writers(self._node, self._topic)})
        return f"{self._topic} comes from {', '.join(names)}" if names else f"nobody publishes {self._topic}"
