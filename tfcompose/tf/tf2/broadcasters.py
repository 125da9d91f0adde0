"""tf2_ros's ``TransformBroadcaster`` and ``StaticTransformBroadcaster``.

They publish transforms on /tf and /tf_static. They require rclpy, but not tf2_msgs.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from tfcompose.tf.tf2.messages import nanoseconds

if TYPE_CHECKING:
    from tfcompose.tf.ros.tf_codec import SentTransform


class TransformBroadcaster:
    """Publishes transforms of moving edges.

    Args:
        node: an rclpy node.
        qos: an rclpy QoSProfile or a depth; by default tf2's: reliable, volatile, the last 100.
    """

    def __init__(self, node: Any, qos: Any = None) -> None:
        from tfcompose.tf.ros.node import TFPublisher  # noqa: PLC0415 (whoever has a node has ROS)

        #: rclpy's publisher, for bytes.
        self.pub_tf = TFPublisher(node, static=False, qos=qos).publisher

    def sendTransform(self, transform: Any) -> None:  # noqa: N802 (tf2_ros's name)
        """Send a TransformStamped, or several in one message."""
        self.pub_tf.publish(_message(map(_plain, _several(transform))))


class StaticTransformBroadcaster:
    """Publishes transforms of fixed edges, latched.

    Each message has all transforms so far, because a latched topic keeps only the last message. As
    in tf2_ros for Python, the first transform of a child frame stays. A transform of the child
    with another parent or pose is not published, and the node's log reports it.

    Args:
        node: an rclpy node.
        qos: an rclpy QoSProfile or a depth; by default tf2's: reliable, transient local, the last
            message.
    """

    def __init__(self, node: Any, qos: Any = None) -> None:
        from tfcompose.tf.ros.node import TFPublisher  # noqa: PLC0415 (whoever has a node has ROS)

        #: rclpy's publisher, for bytes.
        self.pub_tf = TFPublisher(node, static=True, qos=qos).publisher
        self._node = node
        self._sent: dict[str, SentTransform] = {}

    def sendTransform(self, transform: Any) -> None:  # noqa: N802 (tf2_ros's name)
        """Send a TransformStamped, or several, together with those of earlier calls."""
        for each in map(_plain, _several(transform)):
            first = self._sent.setdefault(each.child, each)
            if (first.parent, first.xyz, first.quat_xyzw) != (
                each.parent,
                each.xyz,
                each.quat_xyzw,
            ):
                self._node.get_logger().warning(
                    f"{first.parent} → {each.child} stays as it was sent first: a fixed transform"
                    " is sent once"
                )
        self.pub_tf.publish(_message(self._sent.values()))


def _several(transform: Any) -> Iterable[Any]:
    return transform if isinstance(transform, Iterable) else [transform]


def _plain(message: Any) -> SentTransform:
    # The buffer is used without tfcompose.tf.ros.
    from tfcompose.tf.ros.tf_codec import SentTransform  # noqa: PLC0415

    to, rotation = message.transform.translation, message.transform.rotation
    xyz, quat = (to.x, to.y, to.z), (rotation.x, rotation.y, rotation.z, rotation.w)
    return SentTransform(
        nanoseconds(message.header.stamp),
        message.header.frame_id,
        message.child_frame_id,
        xyz,
        quat,
    )


def _message(transforms: Iterable[SentTransform]) -> bytes:
    from tfcompose.tf.ros.tf_codec import encode  # noqa: PLC0415 (the same)

    return encode(list(transforms))
