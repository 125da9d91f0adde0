"""Static publisher process: latches fixed edges on /tf_static, and the robot's description.

While the process runs, the launcher can order it to read the plan again, with other poses and
another description. Each message on /tf_static contains all edges, because a late listener
receives only the last message.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import msgspec

from tfcompose.foundation.findings import RejectedError
from tfcompose.foundation.text import plural
from tfcompose.model.messages import Reread
from tfcompose.tf.process import ready, say, start, take_orders_fd, wait_for_go
from tfcompose.tf.ros.tf_codec import SentTransform, encode

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tfcompose.foundation.signals import Stop
    from tfcompose.launcher.publishers.description import DescriptionPublisher
    from tfcompose.tf.process import OwnProcess
    from tfcompose.tf.ros.node import PipeReader, TFPublisher


def main(argv: Sequence[str]) -> int:
    """Run the process with arguments PLAN_FILE PROCESS_NAME, and return the exit code."""
    return start(argv, "static", static)


def static(own_process: OwnProcess, stop: Stop) -> None:
    """Publish all fixed edges in one latched message, and the robot description."""
    # ROS, once signals are handled.
    from tfcompose.launcher.publishers.description import CHECK_EVERY_S, DescriptionPublisher  # noqa: PLC0415

    # ROS, once signals are handled.
    from tfcompose.tf.ros.node import PipeReader, TFPublisher, open_node, wait  # noqa: PLC0415

    with open_node(
        own_process.node_name, own_process.namespace, args=own_process.ros_args
    ) as node:
        publisher = TFPublisher(node, static=True)
        if not wait_for_go(stop):
            return
        number = _publish(own_process, publisher)
        say(
            f"{plural(number, 'edge')} on /tf_static"
            if number
            else "the description; no edge is fixed"
        )
        ready()
        description = DescriptionPublisher(own_process, node)
        orders = [PipeReader(node, fd) for fd in take_orders_fd()]
        while not stop.requested:
            wait(
                node,
                [description.subscription, *orders],
                CHECK_EVERY_S if description.is_waiting else None,
                stop,
            )
            for reader in orders:
                own_process = _follow(own_process, reader, publisher, description)
            description.check()


def _publish(own_process: OwnProcess, publisher: TFPublisher) -> int:
    """Publish all edges, and return their number."""
    # A fixed edge holds at every time and tf2 does not look at its stamp; simulated time may
    # not have begun.
    stamp_ns = 0 if own_process.plan.ros.clock == "sim" else time.time_ns()
    edges = [
        SentTransform(stamp_ns, edge.parent, edge.child, edge.pose.xyz, edge.pose.quat_xyzw)
        for edge in own_process.edges
    ]
    if edges:
        publisher.publish(encode(edges))
    return len(edges)


def _follow(
    own_process: OwnProcess,
    orders: PipeReader,
    publisher: TFPublisher,
    description: DescriptionPublisher,
) -> OwnProcess:
    """Publish what the plan in the last order changes; return the process with its plan."""
    files = [msgspec.json.decode(line, type=Reread).file for line in orders.take_lines()]
    if not files:
        return own_process
    try:
        changed = own_process.reread(files[-1])
    except RejectedError as error:
        say(f"keeps the previous poses: {error}")
        return own_process
    if [edge.pose for edge in changed.edges] != [edge.pose for edge in own_process.edges]:
        _publish(changed, publisher)
    description.follow(changed)
    return changed
