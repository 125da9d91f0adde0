"""Recorder: writes TF, joint states and /clock of the running system to a bag, as bytes."""

from __future__ import annotations

from contextlib import ExitStack
from typing import TYPE_CHECKING

from tfcompose.tf.bags import CLOCK
from tfcompose.tf.live.ros_feed import tf_elsewhere
from tfcompose.tf.ros.clock import DeepClockSubscription, wall_ns
from tfcompose.tf.ros.graph import topics
from tfcompose.tf.ros.node import TFSubscription, open_node, wait
from tfcompose.tf.ros.sensor_data import JointStateSubscription
from tfcompose.tf.ros.tf_codec import TF_MESSAGE

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from rclpy.node import Node
    from typing_extensions import Self

    from tfcompose.foundation.signals import Stop
    from tfcompose.tf.bag_writing import BagWriter
    from tfcompose.tf.ros.node import Subscription

    Topics = tuple[str, str]

JOINT_STATE = "sensor_msgs/msg/JointState"


class Recorder:
    """A feed of pairs of TF topics (moving, fixed), joint states and /clock into a bag.

    ``begun`` is called when the first transforms are in the bag.
    """

    def __init__(
        self,
        writer: BagWriter,
        pairs: Iterable[Topics],
        joint_topics: Iterable[str],
        begun: Callable[[], None],
    ) -> None:
        self.writer = writer
        self._begun: Callable[[], None] | None = begun
        self._pairs = tuple(pairs)
        self._joint_topics = tuple(joint_topics)
        self._stack = ExitStack()

    @property
    def received_any(self) -> bool:
        """Whether a message came on a TF topic."""
        return any(topic in self.writer.counts for pair in self._pairs for topic in pair)

    def __enter__(self) -> Self:
        """Start a node with the subscriptions.

        Raises:
            RosError: if ROS cannot start one.
        """
        with ExitStack() as stack:
            self.node = stack.enter_context(open_node("tfcompose_record", ""))
            self._sources = list(self._subscribe(self.node))
            self._stack = stack.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        """End the node."""
        self._stack.close()

    def _subscribe(self, node: Node) -> Iterator[tuple[Subscription, str, bool]]:
        """Yield subscriptions, each with its type and whether its publishers are latched."""
        for pair in self._pairs:
            for static in (True, False):
                source = TFSubscription(node, static=static, topic=pair[static], deep=True)
                yield source, TF_MESSAGE, static
        for topic in self._joint_topics:
            yield JointStateSubscription(node, topic), JOINT_STATE, False
        yield DeepClockSubscription(node), CLOCK, False

    def take(self, timeout_s: float, stop: Stop) -> bool:
        """Wait up to ``timeout_s`` seconds for messages, and write them.

        Raises:
            RosError: if ROS cannot take messages.
            OSError: if the bag cannot be written.
        """
        wait(self.node, [source for source, _, _ in self._sources], timeout_s, stop)
        for source, type_, latched in self._sources:
            for received in source.take():
                received_ns = received.received_ns or wall_ns()
                self.writer.write(source.topic, type_, received.data, received_ns, latched=latched)
        if self._begun and self.received_any:
            self._begun()
            self._begun = None
        return True

    def elsewhere(self) -> tuple[str, ...]:
        """Return the names of other topics with TF."""
        return tf_elsewhere(topics(self.node), [topic for pair in self._pairs for topic in pair])
