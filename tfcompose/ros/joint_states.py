"""The topic ``joint_states``, below the node's namespace; its messages are bytes, see ``joint_codec``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from sensor_msgs.msg import JointState

from tfcompose.ros.joint_codec import encode_names, fill
from tfcompose.ros.node import JOINT_STATES, Subscription

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rclpy.node import Node

TOPIC = "joint_states"
JOINT_STATE_TYPE = "sensor_msgs/msg/JointState"


class JointStateSubscription(Subscription):
    """A subscription to ``joint_states``, or to another topic of its type."""

    def __init__(self, node: Node, topic: str = TOPIC) -> None:
        super().__init__(node, JointState, topic, JOINT_STATES)


class JointStatePublisher:
    """Publishes the positions (rad or m) of the same joints again and again."""

    def __init__(self, node: Node, names: Sequence[str]) -> None:
        self._publisher: Any = node.create_publisher(JointState, TOPIC, 10)
        self._message = encode_names(names)

    @property
    def topic(self) -> str:
        """The topic's full name."""
        name: str = self._publisher.topic_name
        return name

    def publish(self, stamp_ns: int, positions: Sequence[float]) -> None:
        """Publish them, in the names' order, with this time in nanoseconds."""
        fill(self._message, stamp_ns, positions)
        self._publisher.publish(bytes(self._message))
