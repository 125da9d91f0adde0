"""Process that publishes an edge, as a case injects it.

It is given a JSON object, waits for a line, writes one when it begins to publish, and ends with a
signal, or with the process that started it.
"""

from __future__ import annotations

import json
import os
import signal
import sys
from typing import TYPE_CHECKING, Any

from tfcompose.foundation.geometry import Pose
from tfcompose.foundation.signals import Stop
from tfcompose.launcher.child import end_with
from tfcompose.launcher.publishers.simulate import wall_ticks
from tfcompose.tf.process import say
from tfcompose.tf.ros.tf_codec import Template

if TYPE_CHECKING:
    from collections.abc import Mapping


def main() -> int:
    """Publish as the command line requests it; return the exit code."""
    end_with(os.getppid(), signal.SIGTERM)
    request = json.loads(sys.argv[1])
    with Stop() as stop:
        # ROS, once signals are handled.
        from tfcompose.tf.ros.node import load_types  # noqa: PLC0415

        load_types()
        if sys.stdin.readline():
            publish(request, stop)
    return 0


def publish(request: Mapping[str, Any], stop: Stop) -> None:
    """Publish the edge until ``stop`` is requested."""
    from tfcompose.tf.ros.node import TFPublisher, open_node  # noqa: PLC0415 (as above)

    template = Template([(request["parent"], request["child"])])
    template.set_pose(0, Pose(tuple(request["xyz"]), tuple(request["quat_xyzw"])))
    namespace, _, name = request["node"].rpartition("/")
    with open_node(name, namespace) as node:
        publisher = TFPublisher(node, static=False, topic=request["topic"])
        say("publishing")
        for _, stamp_ns in wall_ticks(request["rate"], stop):
            template.set_stamp(stamp_ns)
            publisher.publish(template.data)
