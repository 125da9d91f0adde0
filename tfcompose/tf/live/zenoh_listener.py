"""Listens to TF on Zenoh where no ROS has rmw_zenoh, and feeds observers.

Liveliness tokens name who sent what.
"""

from __future__ import annotations

import os
import time
from contextlib import ExitStack
from typing import TYPE_CHECKING

from tfcompose.tf.live.publishers import Publisher
from tfcompose.tf.ros.tf_codec import Decoder
from tfcompose.tf.ros.zenoh_graph import ZenohGraph, ZenohTF, domain_of, open_session

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from tfcompose.foundation.signals import Stop
    from tfcompose.tf.live.edges import TreeObserver
    from tfcompose.tf.ros.zenoh_graph import TokenOfPublisher

    Topics = tuple[str, str]

#: A wait for messages is not longer, so that what is shown is shown in time, and a signal is
#: followed.
_WAIT_S = 0.1


class ZenohListener:
    """Feeds an observer with what comes on a pair of TF topics (moving, fixed)."""

    def __init__(
        self, graph: ZenohGraph, data: ZenohTF, topics: Topics, observer: TreeObserver
    ) -> None:
        self._graph = graph
        self._data = data
        self._topics = topics
        self._observer = observer
        self._decoder = Decoder()

    def listen(self, timeout_s: float) -> None:
        """Wait for messages, at most so long, and put what has come into the observer."""
        self._data.wait(timeout_s)
        observer = self._observer
        observer.observed_ns = time.time_ns()
        for message in self._data.take():
            gid = message.attachment.gid if message.attachment else None
            try:
                rows = tuple(self._decoder.rows(message.data))
            except ValueError:
                observer.take_malformed(gid)
                continue
            observer.take(rows, static=message.static, gid=gid, received_ns=message.received_ns)
        moving, fixed = self._topics
        publishers = [
            _publisher(one, static=static)
            for topic, static in ((fixed, True), (moving, False))
            for one in self._graph.publishers(topic)
        ]
        observer.take_graph(publishers, sorted({one.node for one in publishers if one.node}))


def _publisher(token: TokenOfPublisher, *, static: bool) -> Publisher:
    return Publisher(
        token.gid,
        token.node,
        static=static,
        topic=token.topic,
        type=token.type,
        latched=token.durability == "transient_local",
        reliable=token.reliability == "reliable",
    )


def listen_on_zenoh(
    observers: Mapping[Topics, TreeObserver],
    stop: Stop,
    *,
    duration_s: float | None,
    every_s: float = 1.0,
    show: Callable[[], object] | None = None,
) -> float:
    """Feed the observers of the topics for some seconds, or until ``stop``.

    ``show`` is called ``every_s``. Return for how many seconds it listened.

    Raises:
        RosError: if there is no router.
    """
    with ExitStack() as stack:
        session = open_session(os.environ)
        stack.callback(session.close)
        domain = domain_of(os.environ)
        graph = ZenohGraph(session, domain)
        listeners = []
        for topics, observer in observers.items():
            data = ZenohTF(session, domain, topics)
            listeners.append(ZenohListener(graph, data, topics, observer))
        begun = time.monotonic()
        end = float("inf") if duration_s is None else begun + duration_s
        due = begun + every_s
        while not stop.requested and (now := time.monotonic()) < end:
            for listener in listeners:
                listener.listen(min(_WAIT_S / len(listeners), end - now))
            if show is not None and time.monotonic() >= due:
                due = time.monotonic() + every_s
                show()
        for listener in listeners:
            listener.listen(0.0)
        return time.monotonic() - begun
