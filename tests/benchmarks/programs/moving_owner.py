"""A node /owner whose frames turn: ``moving_owner.py FRAMES DEPTH RATE FRAMES_A_MESSAGE``.

They are in chains below ``base`` with this depth; the rate is in Hz.
"""

from __future__ import annotations

import math
import signal
import sys
import time

from tfcompose.foundation.geometry import Pose, quat_from_rpy
from tfcompose.tf.ros.node import TFPublisher, open_node
from tfcompose.tf.ros.tf_codec import Template


def main(frames: int, depth: int, rate: int, frames_a_message: int) -> None:
    """Send the frames until the process is stopped."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: sys.exit())
    names = [("base" if n % depth == 0 else f"f{n - 1}", f"f{n}") for n in range(frames)]
    templates = [
        Template(names[first : first + frames_a_message])
        for first in range(0, frames, frames_a_message)
    ]
    with open_node("owner", "") as node:
        publisher = TFPublisher(node, static=False)
        due = begun = time.monotonic()
        while True:
            yaw = math.sin(time.monotonic() - begun)
            pose = Pose((0.1, 0.0, 0.1), quat_from_rpy(0.0, 0.0, yaw))
            for template in templates:
                template.set_stamp(time.time_ns())
                for index in range(frames_a_message):
                    template.set_pose(index, pose)
                publisher.publish(template.data)
            due += 1 / rate
            time.sleep(max(0.0, due - time.monotonic()))


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
