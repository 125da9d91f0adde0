"""Nodes /owner_0 … that publish at the same moment: ``burst_owners.py NODES EDGES RATE``.

Each sends this many edges in one message, base → frame_NODE_EDGE, at the rate in Hz.
"""

from __future__ import annotations

import signal
import sys
import time

from rclpy.context import Context
from rclpy.node import Node

from tfcompose.tf.ros.node import TFPublisher
from tfcompose.tf.ros.tf_codec import Template


def main(nodes: int, edges: int, rate: int) -> None:
    """Publish until the process is stopped."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: sys.exit())
    context = Context()
    context.init()
    owners = []
    for n in range(nodes):
        node = Node(
            f"owner_{n}", context=context, enable_rosout=False, start_parameter_services=False
        )
        template = Template([("base", f"frame_{n}_{edge}") for edge in range(edges)])
        owners.append((TFPublisher(node, static=False), template))
    due = time.monotonic()
    while True:
        for publisher, template in owners:
            template.set_stamp(time.time_ns())
            publisher.publish(template.data)
        due += 1 / rate
        time.sleep(max(0.0, due - time.monotonic()))


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
