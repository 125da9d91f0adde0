"""A node /owner that owns edges: ``owner.py PARENT EDGES RATE [EDGES_A_MESSAGE] [--ros-args …]``.

It sends PARENT → frame_0, frame_1 … at that rate in Hz, in one message unless it says otherwise.
"""

from __future__ import annotations

import signal
import sys
import time

from tfcompose.tf.ros.node import TFPublisher, open_node
from tfcompose.tf.ros.tf_codec import Template


def main(parent: str, edges: int, rate: float, edges_a_message: int, ros_args: list[str]) -> None:
    """Send the edges until the process is stopped."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: sys.exit())
    names = [(parent, f"frame_{n}") for n in range(edges)]
    templates = [
        Template(names[first : first + edges_a_message])
        for first in range(0, edges, edges_a_message)
    ]
    with open_node("owner", "/", args=ros_args) as node:
        publisher = TFPublisher(node, static=False)
        due = time.monotonic()
        while True:
            for template in templates:
                template.set_stamp(time.time_ns())
                publisher.publish(template.data)
            due += 1 / rate
            time.sleep(max(0.0, due - time.monotonic()))


if __name__ == "__main__":
    arguments, _, of_ros = "\n".join(sys.argv[1:]).partition("\n--ros-args\n")
    parent_name, count, hertz, *together = arguments.split("\n")
    main(
        parent_name,
        int(count),
        float(hertz),
        int(together[0]) if together else int(count),
        of_ros.split("\n") if of_ros else [],
    )
