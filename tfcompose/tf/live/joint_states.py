"""Who sends which joints: a topic of joint states, by publisher."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from tfcompose.tf.live.state import JointSender
from tfcompose.tf.ros.clock import wall_ns
from tfcompose.tf.ros.graph import UNKNOWN_NODE, writers
from tfcompose.tf.ros.joint_codec import read_names
from tfcompose.tf.ros.sensor_data import JointStateSubscription

if TYPE_CHECKING:
    from rclpy.node import Node

    from tfcompose.tf.ros.joint_codec import JointNames
    from tfcompose.tf.ros.node import Received


@dataclass(slots=True)
class _Sent:
    """What a publisher sent: all joints, and the names of its newest message."""

    first_ns: int
    last_ns: int
    newest: JointNames
    joints: set[str] = field(default_factory=set)


class JointStates:
    """Listens to a topic of joint states; what came is taken when it is asked for."""

    def __init__(self, node: Node, topic: str) -> None:
        self.topic = topic
        self._node = node
        self._subscription = JointStateSubscription(node, topic)
        self._sent: dict[bytes, _Sent] = {}
        self._nodes: dict[bytes, str] = {}

    def take(self) -> None:
        """Take what has come, and who sent it; a message that is no joint state is left out."""
        for received in self._subscription.take():
            self._take(received)
        if self._sent.keys() - self._nodes.keys():
            self._ask_graph()

    def _take(self, received: Received) -> None:
        gid = received.gid or received.raw_gid or b""
        now_ns = received.received_ns or wall_ns()
        sent = self._sent.get(gid)
        if sent is not None:
            sent.last_ns = now_ns
            if sent.newest.fit(received.data):
                return
        try:
            names = read_names(received.data)
        except ValueError:
            return
        if sent is None:
            sent = self._sent[gid] = _Sent(now_ns, now_ns, names)
        sent.newest = names
        sent.joints.update(names.names)

    def senders(self) -> tuple[JointSender, ...]:
        """Return who sent what until now, those that have left among them."""
        return tuple(
            JointSender(
                self.topic,
                self._nodes.get(gid, ""),
                frozenset(sent.joints),
                sent.first_ns,
                sent.last_ns,
            )
            for gid, sent in self._sent.items()
        )

    def forget(self, before_ns: int) -> None:
        """Forget who sent nothing since then, in nanoseconds of the system's clock."""
        self._sent = {gid: sent for gid, sent in self._sent.items() if sent.last_ns >= before_ns}
        self._nodes = {gid: node for gid, node in self._nodes.items() if gid in self._sent}

    def _ask_graph(self) -> None:
        for writer in writers(self._node, self.topic):
            if writer.node != UNKNOWN_NODE:
                self._nodes[writer.gid] = writer.node
