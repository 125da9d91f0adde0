"""A plain rclpy process that publishes fixed edges once, and stays: ``plain_static.py EDGES``."""

from __future__ import annotations

import contextlib
import sys
from typing import Any

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.qos import DurabilityPolicy, QoSProfile

from tfcompose.tf.ros.tf_codec import Template
from tfcompose.tf.ros.typesupport import tf_message_type


def main(edges: int) -> None:
    """Publish base_link → frame_0, frame_1 …, and spin."""
    rclpy.init()
    node = rclpy.create_node("plain")
    profile: Any = QoSProfile  # rclpy gives its arguments no types
    qos = profile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    publisher = node.create_publisher(tf_message_type(), "/tf_static", qos)
    publisher.publish(Template([("base_link", f"frame_{n}") for n in range(edges)]).data)
    with contextlib.suppress(KeyboardInterrupt, ExternalShutdownException):
        rclpy.spin(node)


if __name__ == "__main__":
    main(int(sys.argv[1]))
