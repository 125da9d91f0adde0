"""Feeds observers from TF on Zenoh, for machines whose ROS has no rmw_zenoh.

Liveliness tokens identify the sender of each message.
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
    from collections.abc import Mapping

    from typing_extensions import Self

    from tfcompose.foundation.signals import Stop
    from tfcompose.tf.live.edges import TreeObserver
    from tfcompose.tf.ros.zenoh_graph import TokenOfPublisher

    Topics = tuple[str, str]


class _TopicFeed:
    """Feeds an observer from a pair of TF topics (moving, fixed)."""

    def __init__(
        self, graph: ZenohGraph, data: ZenohTF, topics: Topics, observer: TreeObserver
    ) -> None:
        self._graph = graph
        self._data = data
        self._topics = topics
        self._observer = observer
        self._decoder = Decoder()

    def take(self, timeout_s: float) -> None:
        """Wait up to ``timeout_s`` seconds for messages, and pass them to the observer."""
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
            _publisher(publisher, static=static)
            for topic, static in ((fixed, True), (moving, False))
            for publisher in self._graph.publishers(topic)
        ]
        observer.take_graph(
            publishers, sorted({publisher.node for publisher in publishers if publisher.node})
        )


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


class ZenohFeed:
    """Feeds the observers of pairs of TF topics (moving, fixed) from its own Zenoh session."""

    def __init__(self, observers: Mapping[Topics, TreeObserver]) -> None:
        self._observers = observers
        self._stack = ExitStack()

    def __enter__(self) -> Self:
        """Open the session.

        Raises:
            RosError: if there is no router.
        """
        with ExitStack() as stack:
            session = open_session(os.environ)
            stack.callback(session.close)
            domain = domain_of(os.environ)
            graph = ZenohGraph(session, domain)
            self._listeners = [
                _TopicFeed(graph, ZenohTF(session, domain, topics), topics, observer)
                for topics, observer in self._observers.items()
            ]
            self._stack = stack.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        """Close the session."""
        self._stack.close()

    def take(self, timeout_s: float, stop: Stop) -> bool:
        """Wait up to ``timeout_s`` seconds for messages, and pass them to the observers."""
        del stop  # the wait cannot be interrupted
        for listener in self._listeners:
            listener.take(timeout_s / len(self._listeners))
        return True

    def elsewhere(self) -> tuple[str, ...]:
        """Return no topics: other topics are unknown."""
        return ()
