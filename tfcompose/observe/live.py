"""Feeds a census from the running system: what comes on /tf and /tf_static, and who publishes there."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

from tfcompose.observe.census import Census, Publisher, nearer_clock
from tfcompose.ros.clock import SimClock, wall_ns
from tfcompose.ros.graph import UNKNOWN_NODE, nodes, own_gid, writers
from tfcompose.ros.node import TFSubscription, wait
from tfcompose.ros.processes import origin
from tfcompose.ros.tf_codec import Decoder

if TYPE_CHECKING:
    from rclpy.node import Node

    from tfcompose.ros.stop import Stop
    from tfcompose.ros.tf_codec import Row

#: The graph is looked at so often, in seconds, and sooner where somebody sends who has no name yet.
LOOK_EVERY_S = 0.5
LOOK_AGAIN_S = 0.02


@dataclass(frozen=True, slots=True)
class Heard:
    """One message: its transforms, whether it came on /tf_static, its publisher's id, and when it came.

    ``sent_ns`` is when it was sent by the clock of its publisher's machine, 0 where that is not known.
    """

    rows: tuple[Row, ...]
    static: bool
    gid: bytes | None
    received_ns: int
    sent_ns: int = 0


class Live:
    """Listens to the topics of moving and of fixed edges, as long as its node lives.

    ``topics`` are (moving, fixed). Where a simulator publishes /clock, stamps that are
    nearer to it than to the system's time are compared with it.
    """

    def __init__(self, node: Node, census: Census, topics: tuple[str, str]) -> None:
        self.node = node
        self.census = census
        self.topics = topics
        self._subscriptions = [
            (TFSubscription(node, static=static, topic=self.topics[static]), static) for static in (True, False)
        ]
        self._clock = SimClock(node)
        self._decoder = Decoder()
        self._where: dict[bytes, str] = {}
        self._own = b""
        self._looked = float("-inf")

    @property
    def clock_ns(self) -> int | None:
        """The newest time on /clock in nanoseconds, or None."""
        return self._clock.now_ns()

    def look(self, timeout_s: float, stop: Stop) -> list[Heard]:
        """Wait for messages, at most so long, put what has come into the census, and return it.

        Raises:
            RosError: if ROS cannot take messages.
        """
        wait(self.node, [subscription for subscription, _ in self._subscriptions], timeout_s, stop)
        sim_ns, now_ns = self.clock_ns, wall_ns()
        heard = []
        for subscription, static in self._subscriptions:
            for received in subscription.take():
                try:
                    rows = tuple(self._decoder.rows(received.data))
                except ValueError:
                    self.census.take_malformed(received.gid)
                    continue
                # Fast DDS tells when a message came; what waited here for its turn is not late.
                came_ns = received.received_ns or now_ns
                heard.append(Heard(rows, static, received.gid, came_ns, received.source_ns))
        for each in heard:
            clock_ns = nearer_clock(each.rows, each.received_ns, sim_ns, static=each.static)
            self.census.take(
                each.rows, static=each.static, gid=each.gid, received_ns=each.received_ns, clock_ns=clock_ns
            )
        self._look_around({each.gid for each in heard if each.gid is not None})
        return heard

    def _look_around(self, senders: set[bytes]) -> None:
        """Look who publishes, where it is time, or somebody without a name sends."""
        since = time.monotonic() - self._looked
        nameless = not all(self.census.is_known(gid) for gid in senders)
        if since >= LOOK_EVERY_S or (nameless and since >= LOOK_AGAIN_S):
            self._looked = time.monotonic()
            self.census.graph(self.publishers(), nodes(self.node))

    def publishers(self) -> list[Publisher]:
        """Return who publishes on the two topics now."""
        return [
            Publisher(
                one.gid,
                None if one.node.endswith(UNKNOWN_NODE) else one.node,
                static,
                one.durability == "transient_local",
                one.reliability == "reliable",
                self._origin(one.gid),
                topic,
                one.type,
            )
            for topic, static in zip(self.topics, (False, True), strict=True)
            for one in writers(self.node, topic)
        ]

    def _origin(self, gid: bytes) -> str:
        if gid not in self._where:
            self._own = self._own or own_gid(self.node, self.topics[0])
            self._where[gid] = origin(gid, self._own)
        return self._where[gid]
