"""Feeds observers from TF topics of the running system, without an executor."""

from __future__ import annotations

import time
from contextlib import ExitStack
from functools import partial
from typing import TYPE_CHECKING

from tfcompose.tf.live.edges import nearer_clock
from tfcompose.tf.live.flood import ReadingTime
from tfcompose.tf.live.joint_states import JointStates
from tfcompose.tf.live.topics import TFGraph, TFTopics
from tfcompose.tf.ros.clock import SimClock, wall_ns
from tfcompose.tf.ros.graph import nodes, topics
from tfcompose.tf.ros.node import open_node, wait
from tfcompose.tf.ros.tf_codec import TF_MESSAGE, Decoder

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from rclpy.node import Node
    from typing_extensions import Self

    from tfcompose.foundation.signals import Stop
    from tfcompose.tf.live.edges import TreeObserver
    from tfcompose.tf.live.topics import TFData
    from tfcompose.tf.ros.node import Received

    Topics = tuple[str, str]

#: Interval between queries of the graph in seconds. It is queried sooner if a sender has no name
#: yet.
ASK_EVERY_S = 0.5
ASK_AGAIN_S = 0.02


class TreeListener:
    """Feeds an observer from a pair of TF topics (moving, fixed), while its node exists.

    If a simulator publishes /clock, stamps that are nearer to /clock than to system time are
    compared with /clock.
    """

    def __init__(self, node: Node, observer: TreeObserver, topics: Topics) -> None:
        self.node = node
        self.observer = observer
        self.topics = topics
        self.graph = TFGraph(node, topics)
        self._data = TFTopics(node, topics)
        self._clock = SimClock(node)
        self._decoder = Decoder()
        self._time = ReadingTime(self._decoder)
        self._requested_at = float("-inf")
        #: Minimum lead of each publisher's clock in seconds, by the publisher's id.
        self.skews_s: dict[bytes, float] = {}

    @property
    def clock_ns(self) -> int | None:
        """The newest time on /clock in nanoseconds, or None."""
        return self._clock.now_ns()

    def take(self, timeout_s: float, stop: Stop) -> None:
        """Wait for messages for a bounded time, and observe them.

        Raises:
            RosError: if ROS cannot take messages.
        """
        wait(self.node, self._data.readers, timeout_s, stop)
        sim_ns, now_ns = self.clock_ns, wall_ns()
        self.observer.observed_ns = now_ns
        senders: set[bytes] = set()

        def read(data: TFData) -> None:
            received = data.received
            try:
                rows = tuple(self._decoder.rows(received.data))
            except ValueError:
                self.observer.take_malformed(received.gid)
                return
            # Fast DDS reports the arrival of a message, so waiting for this code does not count as
            # a delay.
            came_ns = received.received_ns or now_ns
            clock_ns = nearer_clock(rows, came_ns, sim_ns, static=data.static)
            self.observer.take(
                rows, static=data.static, gid=received.gid, received_ns=came_ns, clock_ns=clock_ns
            )
            if received.gid is not None:
                senders.add(received.gid)
                if not data.static:  # a latched message may be old
                    self._compare_clocks(received.gid, received)

        now = time.monotonic()
        for data in list(self._data.take()):
            self._time.read(data.received, partial(read, data), self.observer.floods, now)
        self._ask_graph(senders)

    def _compare_clocks(self, gid: bytes, received: Received) -> None:
        if received.source_ns:
            ahead_s = (received.source_ns - (received.received_ns or wall_ns())) / 1e9
            self.skews_s[gid] = max(ahead_s, self.skews_s.get(gid, ahead_s))

    def _ask_graph(self, senders: set[bytes]) -> None:
        """Query the graph if it is due, or if a sender has no name yet."""
        since = time.monotonic() - self._requested_at
        nameless = not all(self.observer.publishers.is_named(gid) for gid in senders)
        if since >= ASK_EVERY_S or (nameless and since >= ASK_AGAIN_S):
            self._requested_at = time.monotonic()
            self.observer.take_graph(self.graph.publishers(), nodes(self.node))


class RosFeed:
    """Feeds the observers of pairs of TF topics (moving, fixed), with a node of its own.

    Args:
        name: the name of the node.
        observers: observers by topics.
        joint_topics: topics of joint states, whose publishers and joints are observed.
    """

    def __init__(
        self, name: str, observers: Mapping[Topics, TreeObserver], joint_topics: Iterable[str] = ()
    ) -> None:
        self._name = name
        self._observers = observers
        self._joint_topics = tuple(joint_topics)
        self._stack = ExitStack()

    def __enter__(self) -> Self:
        """Start the node.

        Raises:
            RosError: if ROS cannot start one.
        """
        with ExitStack() as stack:
            self.node = stack.enter_context(open_node(self._name, ""))
            self.listeners = [
                TreeListener(self.node, observer, pair)
                for pair, observer in self._observers.items()
            ]
            self._joints = [JointStates(self.node, topic) for topic in self._joint_topics]
            self._stack = stack.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        """Pass the senders of joint states to the observers, and end the node."""
        self.pass_joints()
        self._stack.close()

    def pass_joints(self) -> None:
        """Pass the senders of joint states so far to the observers."""
        sent = tuple(sent for joints in self._joints for sent in joints.sent_joints())
        for observer in self._observers.values():
            observer.sent_joints = sent

    @property
    def clock_ns(self) -> int | None:
        """The newest time on /clock in nanoseconds, or None."""
        return next((listener.clock_ns for listener in self.listeners), None)

    def take(self, timeout_s: float, stop: Stop) -> bool:
        """Wait up to ``timeout_s`` seconds for messages, and pass them to the observers.

        Raises:
            RosError: if ROS cannot take messages.
        """
        for listener in self.listeners:
            listener.take(timeout_s / len(self.listeners), stop)
        if not self.listeners:
            stop.wait(timeout_s)
        for joints in self._joints:
            joints.take()
        return True

    def elsewhere(self) -> tuple[str, ...]:
        """Return the names of other topics with TF."""
        observed = [topic for pair in self._observers for topic in pair]
        return tf_elsewhere(topics(self.node), observed)


def tf_elsewhere(
    topics: Iterable[tuple[str, Sequence[str]]], observed: Iterable[str]
) -> tuple[str, ...]:
    """Return names of further TF topics from (name, types), without hidden ones (``/_…``)."""
    return tuple(
        name
        for name, types in topics
        if TF_MESSAGE in types and name not in set(observed) and "/_" not in name
    )
