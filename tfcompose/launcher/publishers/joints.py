"""The ``joints`` process: converts joint states to edges on /tf, and reports missing joints."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from tfcompose.foundation.text import list_names, plural
from tfcompose.tf.process import ready, say, start, wait_for_go

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from tfcompose.foundation.signals import Stop
    from tfcompose.launcher.publishers.joint_mover import JointMover
    from tfcompose.tf.process import OwnProcess

MISSING_AFTER_S = 5.0
_NAMED_AT_MOST = 8


def main(argv: Sequence[str]) -> int:
    """Run the process with arguments PLAN_FILE PROCESS_NAME, and return the exit code."""
    return start(argv, "joints", joints)


def joints(own_process: OwnProcess, stop: Stop) -> None:
    """Publish the moving edges of each ``joint_states`` message.

    Also publish the robot description if the plan has no ``static`` process for it.
    """
    # ROS, once signals are handled.
    from tfcompose.launcher.publishers.description import CHECK_EVERY_S, DescriptionPublisher  # noqa: PLC0415

    # ROS, once signals are handled.
    from tfcompose.launcher.publishers.joint_mover import JointMover, PublishOptions  # noqa: PLC0415
    from tfcompose.tf.ros.clock import StampClock  # noqa: PLC0415 (ROS, once signals are handled)

    # ROS, once signals are handled.
    from tfcompose.tf.ros.graph import publishing_nodes  # noqa: PLC0415

    # ROS, once signals are handled.
    from tfcompose.tf.ros.node import TFPublisher, WaitSet, open_node, parameter  # noqa: PLC0415

    # ROS, once signals are handled.
    from tfcompose.tf.ros.sensor_data import JointStateSubscription  # noqa: PLC0415

    with open_node(
        own_process.node_name, own_process.namespace, args=own_process.ros_args
    ) as node:
        options = PublishOptions(
            parameter(node, "publish_frequency", 0.0),
            parameter(node, "ignore_timestamp", default=False),
        )
        clock = StampClock(node, say, sim=own_process.plan.ros.clock == "sim")
        mover = JointMover(own_process.edges, say, clock.now_ns, options)
        publisher = TFPublisher(node, static=False)
        states = JointStateSubscription(node)
        if not wait_for_go(stop):
            return
        states.take()  # messages from before the start are outdated
        description = (
            DescriptionPublisher(own_process, node)
            if own_process.plan.describes(own_process.process)
            else None
        )
        at_most = (
            f", at most {options.publish_frequency:g} Hz" if options.publish_frequency else ""
        )
        say(f"{plural(len(mover), 'edge')} on /tf, from {states.topic}{at_most}")
        ready()
        missing = _Missing(mover, states.topic, lambda: publishing_nodes(node, states.topic))
        texts = [description.subscription] if description else []
        wait_set = WaitSet(node, [states, *texts], stop)
        while not stop.requested:
            is_waiting = missing.is_waiting or clock.is_waiting
            is_waiting = is_waiting or (description is not None and description.is_waiting)
            with_something = wait_set.wait(CHECK_EVERY_S if is_waiting else None)
            for received in states.take() if states in with_something else ():
                message = mover.tf_message(received.data, received.received_ns)
                if message is not None:
                    publisher.publish(message)
            if description and (description.is_waiting or texts[0] in with_something):
                description.check()
            missing.check()
            clock.check()


class _Missing:
    """Reports once, after some seconds, the joints that no joint state contains."""

    def __init__(self, mover: JointMover, topic: str, publishers: Callable[[], list[str]]) -> None:
        self._mover, self._topic, self._publishers = mover, topic, publishers
        self._due = time.monotonic() + MISSING_AFTER_S
        self.is_waiting = len(mover) > 0

    def check(self) -> None:
        if not self.is_waiting or time.monotonic() < self._due:
            return
        self.is_waiting = False
        names = self._mover.missing
        if names:
            say(
                f"no joint state after {MISSING_AFTER_S:g} s for"
                f" {list_names(names, _NAMED_AT_MOST)}: {self._senders()}"
            )

    def _senders(self) -> str:
        names = self._publishers()
        return (
            f"{self._topic} comes from {', '.join(names)}"
            if names
            else f"no node publishes {self._topic}"
        )
