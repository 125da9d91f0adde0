"""What the listeners of processes hear that are fenced off by remapping: the rest of the tree.

Their own messages they have already, on the topics that they were remapped to. Everything else is sent there too, as
long as somebody listens: moving edges as they come, fixed ones latched, all in one message.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from tfcompose.ros.node import TFPublisher
from tfcompose.ros.tf_codec import encode

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping

    from rclpy.node import Node

    from tfcompose.ros.tf_codec import Transform

    Topics = tuple[str, str]


@dataclass(slots=True)
class _Listener:
    """A process's topics, and what is sent to them: nothing (None) until somebody listens."""

    topics: Topics
    moving: TFPublisher | None = None
    fixed: TFPublisher | None = None
    is_told: bool = False


class Feedback:
    """Sends to processes what others send. ``own`` takes the ids of its publishers; the node listens there itself."""

    def __init__(self, node: Node, private: Mapping[str, Topics], own: set[bytes | None]) -> None:
        self._node = node
        self._own = own
        self._listeners = {process: _Listener(topics) for process, topics in private.items()}
        self._fixed: dict[bytes, tuple[str, dict[str, Transform]]] = {}

    def look(self) -> None:
        """See who listens now, and latch for them what has changed."""
        for process, one in self._listeners.items():
            if one.moving is None and self._is_heard(one.topics[0]):
                one.moving = self._publisher(one.topics[0], static=False)
            if one.fixed is None and self._is_heard(one.topics[1]):
                one.fixed = self._publisher(one.topics[1], static=True)
            if one.fixed and not one.is_told:
                one.is_told = True
                one.fixed.publish(encode(self._rest(process)))

    def moving(self, data: bytes, sender: str) -> None:
        """Send a message to all but the process that it is from; empty: it is from none of them."""
        for process, one in self._listeners.items():
            if one.moving and process != sender:
                one.moving.publish(data)

    def fixed(self, source: bytes, edges: Mapping[str, Transform], sender: str) -> None:
        """Latch the fixed edges of one source, by their child, with the next look."""
        known = self._fixed.pop(source, (sender, {}))[1]  # the newest comes last
        self._fixed[source] = (sender, {**known, **edges})
        self._tell_all_but(sender)

    def forget(self, sources: Collection[bytes]) -> None:
        """Latch the edges of these no more."""
        for source in [one for one in sources if one in self._fixed]:
            self._tell_all_but(self._fixed.pop(source)[0])

    def sources(self, sender: str) -> list[bytes]:
        """Return the sources of fixed edges that are from that process; empty: from none of them."""
        return [source for source, (process, _) in self._fixed.items() if process == sender]

    def _rest(self, process: str) -> list[Transform]:
        rest: dict[str, Transform] = {}
        for sender, edges in self._fixed.values():
            if sender != process:
                rest |= edges
        return list(rest.values())

    def _tell_all_but(self, sender: str) -> None:
        for process, one in self._listeners.items():
            one.is_told = one.is_told and process == sender

    def _is_heard(self, topic: str) -> bool:
        return self._node.count_subscribers(topic) > 1  # the first is the node's own

    def _publisher(self, topic: str, *, static: bool) -> TFPublisher:
        publisher = TFPublisher(self._node, static=static, topic=topic)
        self._own.add(publisher.raw_gid)
        return publisher
