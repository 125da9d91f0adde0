"""Texts on a topic: std_msgs/String."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rclpy.serialization import deserialize_message
from std_msgs.msg import String

from tfcompose.ros.tf import Subscription

if TYPE_CHECKING:
    from rclpy.node import Node
    from rclpy.qos import QoSProfile

    from tfcompose.ros.tf import Received


class TextSubscription(Subscription):
    """A subscription to texts."""

    def __init__(self, node: Node, topic: str, qos: QoSProfile) -> None:
        super().__init__(node, String, topic, qos)

    def take_texts(self) -> list[tuple[Received, str]]:
        """Return what has come since the last time, oldest first; what is no text is left out."""
        return [(received, text) for received in self.take() if (text := _text(received.data)) is not None]


def _text(data: bytes) -> str | None:
    try:
        text: str = deserialize_message(data, String).data
    except Exception:  # noqa: BLE001 (rclpy's name for bytes that are no String is not public)
        return None
    return text
