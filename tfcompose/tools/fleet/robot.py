"""Process that runs on a robot, reads its TF through ROS, and shares its edges."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.model.plan.topics import topics_below
from tfcompose.tf.ros.tf_listener import ThreadListener, TransformTopic
from tfcompose.tools.fleet.share import BEAT_S, EdgeSender

if TYPE_CHECKING:
    from collections.abc import Callable

    from tfcompose.foundation.signals import Stop
    from tfcompose.tools.fleet.spec import FleetSpec


def share(
    fleet: FleetSpec, robot: str, namespace: str, stop: Stop, say: Callable[[str], None]
) -> None:
    """Share a robot's edges until ``stop`` is requested.

    ``namespace`` is the namespace of the robot's TF topics.

    Raises:
        RosError: if ROS cannot start a node.
    """
    sender = EdgeSender(fleet, robot, say)
    moving, fixed = topics_below(namespace)
    topics = [
        TransformTopic(fixed, static=True, qos=None),
        TransformTopic(moving, static=False, qos=None),
    ]
    listener = ThreadListener(sender.on_message, topics, use_sim_time=False)
    listener.start()
    try:
        while not stop.requested:
            sender.beat()
            stop.wait(BEAT_S)
    finally:
        listener.close()
        sender.close()
