"""Publishers of joint states on a topic, and the joints that each of them sends."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import chain
from typing import TYPE_CHECKING

from tfcompose.tf.live.sent_joints import SentJoints
from tfcompose.tf.ros.clock import wall_ns
from tfcompose.tf.ros.graph import UNKNOWN_NODE, writers
from tfcompose.tf.ros.joint_codec import read_names
from tfcompose.tf.ros.sensor_data import JointStateSubscription

if TYPE_CHECKING:
    from rclpy.node import Node

    from tfcompose.tf.ros.joint_codec import JointNames
    from tfcompose.tf.ros.node import Received


#: Maximum number of lists to remember. A publisher that splits its joints over several messages
#: sends each list of names repeatedly.
MOST_LISTS = 64


@dataclass(slots=True)
class _Sent:
    """A publisher's newest lists of names, each with its last arrival."""

    first_ns: int
    lists: list[tuple[JointNames, int]] = field(default_factory=list)

    @property
    def last_ns(self) -> int:
        return self.lists[-1][1]

    @property
    def joints(self) -> frozenset[str]:
        return frozenset(chain.from_iterable(names.names for names, _ in self.lists))


class JointStates:
    """Subscription to a topic of joint states; ``take`` reads pending messages."""

    def __init__(self, node: Node, topic: str) -> None:
        self.topic = topic
        self._node = node
        self._subscription = JointStateSubscription(node, topic)
        self._sent: dict[bytes, _Sent] = {}
        self._nodes: dict[bytes, str] = {}

    def take(self) -> None:
        """Read pending messages with their publishers. Skip messages that are not joint states."""
        for received in self._subscription.take():
            self._take(received)
        if self._sent.keys() - self._nodes.keys():
            self._ask_graph()

    def _take(self, received: Received) -> None:
        gid = received.gid or received.raw_gid or b""
        now_ns = received.received_ns or wall_ns()
        sent = self._sent.get(gid) or _Sent(now_ns)
        names = next((names for names, _ in sent.lists if names.fit(received.data)), None)
        if names is None:
            try:
                names = read_names(received.data)
            except ValueError:
                return
        earlier = [names_at for names_at in sent.lists if names_at[0] is not names]
        sent.lists = [*earlier[1 - MOST_LISTS :], (names, now_ns)]
        self._sent[gid] = sent

    def sent_joints(self) -> tuple[SentJoints, ...]:
        """Return the joints of each publisher, including publishers that have left."""
        return tuple(
            SentJoints(
                self.topic,
                self._nodes.get(gid, ""),
                sent.joints,
                sent.first_ns,
                sent.last_ns,
            )
            for gid, sent in self._sent.items()
        )

    def forget(self, before_ns: int) -> None:
        """Drop joints last sent before this time, in nanoseconds of the system clock."""
        for sent in self._sent.values():
            sent.lists = [names_at for names_at in sent.lists if names_at[1] >= before_ns]
        self._sent = {gid: sent for gid, sent in self._sent.items() if sent.lists}
        self._nodes = {gid: node for gid, node in self._nodes.items() if gid in self._sent}

    def _ask_graph(self) -> None:
        for writer in writers(self._node, self.topic):
            if writer.node != UNKNOWN_NODE:
                self._nodes[writer.gid] = writer.node
