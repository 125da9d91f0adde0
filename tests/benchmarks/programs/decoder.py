"""A plain rclpy node that decodes what comes on /tf."""

from __future__ import annotations

import contextlib

import rclpy
from rclpy.executors import ExternalShutdownException

from tfcompose.tf.ros.tf_codec import Decoder
from tfcompose.tf.ros.typesupport import tf_message_type


def main() -> None:
    """Decode until the process is stopped."""
    rclpy.init()
    node, decoder = rclpy.create_node("listener"), Decoder()

    def take(data: bytes) -> None:
        for _ in decoder.rows(data):
            pass

    node.create_subscription(tf_message_type(), "/tf", take, 1000, raw=True)
    with contextlib.suppress(KeyboardInterrupt, ExternalShutdownException):
        rclpy.spin(node)


if __name__ == "__main__":
    main()
