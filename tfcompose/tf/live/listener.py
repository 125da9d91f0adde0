"""Listens to TF topics of the running system, without an executor, and feeds observers."""

from __future__ import annotations

import time
from functools import partial
from typing import TYPE_CHECKING

from tfcompose.tf.live.edges import nearer_clock
from tfcompose.tf.live.flood import ReadingTime
from tfcompose.tf.live.topics import TFGraph, TFTopics
from tfcompose.tf.ros.clock import SimClock, wall_ns
from tfcompose.tf.ros.graph import nodes, topics
from tfcompose.tf.ros.node import open_node, wait
from tfcompose.tf.ros.tf_codec import TF_MESSAGE, Decoder

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from rclpy.node import Node

    from tfcompose.foundation.signals import Stop
    from tfcompose.tf.live.edges import TreeObserver
    from tfcompose.tf.live.topics import TFData

    Topics = tuple[str, str]

#: The graph is asked so often, in seconds, and sooner where somebody sends who has no name yet.
ASK_EVERY_S = 0.5
ASK_AGAIN_S = 0.02
#: A wait for messages is not longer, so that what is shown is shown in time.
_WAIT_S = 0.1
#: So long the last look waits: where the whole process was kept from running, what came is still
#: under way in it.
LAST_WAIT_S = 0.1


class TreeListener:
    """Feeds an observer from a pair of TF topics (moving, fixed) while its node lives.

    Where a simulator publishes /clock, stamps that are nearer to it than to the system's time are
    compared with it.
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

    @property
    def clock_ns(self) -> int | None:
        """The newest time on /clock in nanoseconds, or None."""
        return self._clock.now_ns()

    def listen(self, timeout_s: float, stop: Stop) -> list[TFData]:
        """Wait for messages for a bounded time; observe and return those that were read.

        Raises:
            RosError: if ROS cannot take messages.
        """
        wait(self.node, self._data.readers, timeout_s, stop)
        sim_ns, now_ns = self.clock_ns, wall_ns()
        self.observer.observed_ns = now_ns
        taken: list[TFData] = []

        def read(data: TFData) -> None:
            received = data.received
            try:
                rows = tuple(self._decoder.rows(received.data))
            except ValueError:
                self.observer.take_malformed(received.gid)
                return
            # Fast DDS tells when a message came; what waited here for its turn is not late.
            came_ns = received.received_ns or now_ns
            clock_ns = nearer_clock(rows, came_ns, sim_ns, static=data.static)
            self.observer.take(
                rows, static=data.static, gid=received.gid, received_ns=came_ns, clock_ns=clock_ns
            )
            taken.append(data)

        now = time.monotonic()
        for data in list(self._data.take()):
            self._time.read(data.received, partial(read, data), self.observer.floods, now)
        self._ask_graph({each.received.gid for each in taken if each.received.gid is not None})
        return taken

    def _ask_graph(self, senders: set[bytes]) -> None:
        """Query the graph if it is due, or if a sender has no name yet."""
        since = time.monotonic() - self._requested_at
        nameless = not all(self.observer.publishers.is_named(gid) for gid in senders)
        if since >= ASK_EVERY_S or (nameless and since >= ASK_AGAIN_S):
            self._requested_at = time.monotonic()
            self.observer.take_graph(self.graph.publishers(), nodes(self.node))


def listen(  # noqa: PLR0913 (all but three are named)
    name: str,
    observers: Mapping[Topics, TreeObserver],
    stop: Stop,
    *,
    duration_s: float | None,
    every_s: float = 1.0,
    show: Callable[[], object] | None = None,
) -> tuple[float, tuple[str, ...]]:
    """Feed the observers of the topics for some seconds, or until ``stop``.

    ``show`` is called ``every_s``. The node's name is ``name``.
    Return for how many seconds it listened, and the names of other topics on which there is TF.

    Raises:
        RosError: if ROS cannot start a node, or take messages.
    """
    with open_node(name, "") as node:
        listeners = [TreeListener(node, observer, pair) for pair, observer in observers.items()]
        begun = time.monotonic()  # a slow machine may take seconds until it listens
        end = float("inf") if duration_s is None else begun + duration_s
        due = begun + every_s
        while not stop.requested and (now := time.monotonic()) < end:
            for listener in listeners:
                listener.listen(min(_WAIT_S / len(listeners), end - now), stop)
            if show is not None and time.monotonic() >= due:
                due = time.monotonic() + every_s
                show()
        for listener in listeners:
            listener.listen(
                LAST_WAIT_S, stop
            )  # what came while this process was kept from looking
        return time.monotonic() - begun, tf_elsewhere(
            topics(node), [topic for pair in observers for topic in pair]
        )


def tf_elsewhere(
    topics: Iterable[tuple[str, Sequence[str]]], own: Iterable[str]
) -> tuple[str, ...]:
    """Return the names of TF topics, of (name, types), not ours and not hidden (``/_…``)."""
    return tuple(
        name
        for name, types in topics
        if TF_MESSAGE in types and name not in set(own) and "/_" not in name
    )
