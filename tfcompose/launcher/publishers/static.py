"""Static publisher process: latches fixed edges on /tf_static and the description."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from tfcompose.foundation.text import plural
from tfcompose.tf.process import ready, say, start, wait_for_go
from tfcompose.tf.ros.tf_codec import SentTransform, encode

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tfcompose.foundation.signals import Stop
    from tfcompose.tf.process import Own


def main(argv: Sequence[str]) -> int:
    """Run the process that PLAN_FILE PROCESS_NAME names, and return the exit code."""
    return start(argv, "static", static)


def static(own: Own, stop: Stop) -> None:
    """Latch all fixed edges in one message, and the description."""
    # ROS, once signals are handled.
    from tfcompose.launcher.publishers.description import CHECK_EVERY_S, DescriptionPublisher  # noqa: PLC0415

    # ROS, once signals are handled.
    from tfcompose.tf.ros.node import TFPublisher, open_node, wait  # noqa: PLC0415

    with open_node(own.node_name, own.namespace, args=own.ros_args) as node:
        publisher = TFPublisher(node, static=True)
        if not wait_for_go(stop):
            return
        # A fixed edge holds at every time and tf2 does not look at its stamp; simulated time may
        # not have begun.
        stamp_ns = 0 if own.plan.ros.clock == "sim" else time.time_ns()
        edges = [
            SentTransform(stamp_ns, e.parent, e.child, e.pose.xyz, e.pose.quat_xyzw)
            for e in own.edges
        ]
        if edges:
            publisher.publish(encode(edges))
        say(
            f"{plural(len(edges), 'edge')} on /tf_static"
            if edges
            else "the description; no edge is fixed"
        )
        ready()
        description = DescriptionPublisher(own, node)
        while not stop.requested:
            wait(
                node,
                [description.subscription],
                CHECK_EVERY_S if description.is_waiting else None,
                stop,
            )
            description.check()
