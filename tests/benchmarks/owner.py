"""A program that owns edges: ``python owner.py PARENT EDGES HERTZ [--ros-args …]``.

It sends PARENT → frame_0, frame_1 … in one message at that rate, until it is stopped.
"""

from __future__ import annotations

import signal
import sys
import time

from tfcompose.tf.ros.node import TFPublisher, open_node
from tfcompose.tf.ros.tf_codec import Template


def main(parent: str, edges: int, hertz: float, ros_args: list[str]) -> None:
    """Send the edges until the process is stopped."""
    signal.signal(signal.SIGINT, lambda *_: sys.exit())
    with open_node("owner", "/", args=ros_args) as node:
        publisher = TFPublisher(node, static=False)
        template = Template([(parent, f"frame_{n}") for n in range(edges)])
        due = time.monotonic()
        while True:
            template.set_stamp(time.time_ns())
            publisher.publish(template.data)
            due += 1 / hertz
            time.sleep(max(0.0, due - time.monotonic()))


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), float(sys.argv[3]), sys.argv[5:])
