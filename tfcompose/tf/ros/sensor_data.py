"""Sensor topics: joint states in the node's namespace, and headers of messages.

Messages are bytes. ``joint_codec`` reads and writes joint states, and ``header_codec`` reads
headers.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from rclpy.qos import DurabilityPolicy, ReliabilityPolicy

from tfcompose.tf.ros.graph import gid_of
from tfcompose.tf.ros.header_codec import read_header
from tfcompose.tf.ros.joint_codec import encode_names, fill
from tfcompose.tf.ros.node import JOINT_STATES, Subscription, qos
from tfcompose.tf.ros.typesupport import joint_state_type

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rclpy.node import Node


JOINT_STATES_TOPIC = "joint_states"


class JointStateSubscription(Subscription):
    """A subscription to ``joint_states``, or to another topic of its type."""

    def __init__(self, node: Node, topic: str = JOINT_STATES_TOPIC) -> None:
        super().__init__(node, joint_state_type(), topic, JOINT_STATES)


class JointStatePublisher:
    """Publishes the positions (rad or m) of the same joints repeatedly."""

    def __init__(self, node: Node, names: Sequence[str], topic: str = JOINT_STATES_TOPIC) -> None:
        self._node = node
        self._publisher: Any = node.create_publisher(joint_state_type(), topic, 10)
        self._message = encode_names(names)

    @property
    def topic(self) -> str:
        """The topic's full name."""
        name: str = self._publisher.topic_name
        return name

    @property
    def gid(self) -> bytes:
        """The id in its messages."""
        return gid_of(self._publisher)

    def publish(self, stamp_ns: int, positions: Sequence[float]) -> None:
        """Publish the positions in the order of the names, with a stamp in nanoseconds."""
        fill(self._message, stamp_ns, positions)
        self._publisher.publish(bytes(self._message))

    def close(self) -> None:
        """Destroy the publisher before the node ends."""
        self._node.destroy_publisher(self._publisher)


#: Types of messages with a header whose frame is looked up in TF. Images are excluded, because
#: their CameraInfo has the same header.
HEADED = (
    "sensor_msgs/msg/LaserScan",
    "sensor_msgs/msg/PointCloud2",
    "sensor_msgs/msg/CameraInfo",
    "sensor_msgs/msg/Imu",
    "sensor_msgs/msg/Range",
    "nav_msgs/msg/Odometry",
)


class HeaderSubscription(Subscription):
    """A subscription whose messages begin with a header.

    The topic has a type in ``HEADED``, or another type that begins with a header. The subscription
    matches any publisher, and keeps the last ``depth`` messages until they are taken.

    Raises:
        ImportError: if the type is not installed.
    """

    def __init__(self, node: Node, topic: str, type_: str, depth: int = 5) -> None:
        package, _, name = type_.split("/")
        profile = qos(depth, DurabilityPolicy.VOLATILE, ReliabilityPolicy.BEST_EFFORT)
        super().__init__(node, getattr(import_module(f"{package}.msg"), name), topic, profile)
        self.type = type_

    def take_headers(self) -> list[tuple[str, int, int]]:
        """Return frame, stamp and arrival in nanoseconds of each received message.

        Messages without a header are skipped.
        """
        headers = []
        for received in self.take():
            header = read_header(received.data)
            if header is not None:
                headers.append((*header, received.received_ns))
        return headers
