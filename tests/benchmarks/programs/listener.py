"""A stock listener of /tf_static: ``python listener.py EDGES``.

It prints ``listens``; then, once it has this many edges, the seconds since before ``rclpy.init``
and the machine's monotonic clock.
"""

from __future__ import annotations

import sys
import time
from typing import Any

import rclpy
from rclpy.qos import DurabilityPolicy, QoSProfile

from tfcompose.tf.ros.tf_codec import decode
from tfcompose.tf.ros.typesupport import tf_message_type


def main(edges: int) -> None:
    """Listen until all edges have come."""
    began = time.monotonic()
    rclpy.init()
    node: Any = rclpy.create_node("listener")
    children: set[str] = set()

    def take(data: bytes) -> None:
        children.update(transform.child for transform in decode(data))

    profile: Any = QoSProfile  # rclpy gives its arguments no types
    qos = profile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    node.create_subscription(tf_message_type(), "/tf_static", take, qos, raw=True)
    sys.stdout.write("listens\n")
    sys.stdout.flush()
    while len(children) < edges:
        rclpy.spin_once(node, timeout_sec=10)
    ended = time.monotonic()
    sys.stdout.write(f"{ended - began} {ended}\n")
    sys.stdout.flush()
    node.destroy_node()
    rclpy.shutdown()


if __name__ == "__main__":
    main(int(sys.argv[1]))
