"""Joint states: sensor_msgs/JointState in and out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rclpy.serialization import deserialize_message
from sensor_msgs.msg import JointState

from tfcompose.ros.node import JOINT_STATES
from tfcompose.ros.tf import Subscription

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from rclpy.node import Node

_SECOND_NS = 1_000_000_000
TOPIC = "joint_states"


@dataclass(frozen=True, slots=True)
class Positions:
    """What one message says: names and positions as they came (rad or m), its stamp, and when it was received."""

    names: Sequence[str]
    positions: Sequence[float]
    stamp_ns: int
    received_ns: int


class JointStateSubscription(Subscription):
    """A subscription to ``joint_states``, below the node's namespace."""

    def __init__(self, node: Node) -> None:
        super().__init__(node, JointState, TOPIC, JOINT_STATES)

    @property
    def topic(self) -> str:
        """The topic's full name."""
        name: str = self.subscription.topic_name
        return name

    def take_positions(self) -> list[Positions | None]:
        """Return what has come since the last time, oldest first; None stands for bytes that are no JointState."""
        return [_positions(received.data, received.received_ns) for received in self.take()]


def _positions(data: bytes, received_ns: int) -> Positions | None:
    try:
        message = deserialize_message(data, JointState)
    except Exception:  # noqa: BLE001 (rclpy's name for bytes that are no JointState is not public)
        return None
    stamp = message.header.stamp
    return Positions(message.name, message.position, stamp.sec * _SECOND_NS + stamp.nanosec, received_ns)


class JointStatePublisher:
    """Publishes the same positions (rad or m, by joint name) again and again."""

    def __init__(self, node: Node, positions: Mapping[str, float]) -> None:
        self._publisher: Any = node.create_publisher(JointState, TOPIC, 10)
        self._message = JointState(name=list(positions), position=list(positions.values()))

    @property
    def topic(self) -> str:
        """The topic's full name."""
        name: str = self._publisher.topic_name
        return name

    def publish(self, stamp_ns: int) -> None:
        """Publish them with this time, in nanoseconds."""
        self._message.header.stamp.sec, self._message.header.stamp.nanosec = divmod(stamp_ns, _SECOND_NS)
        self._publisher.publish(self._message)
