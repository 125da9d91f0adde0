"""Fills a buffer with what comes on /tf and /tf_static, as tf2_ros's ``TransformListener`` does."""

from __future__ import annotations

import weakref
from importlib import import_module
from typing import TYPE_CHECKING, Any

from tfcompose.ros.decoder import Decoder
from tfcompose.ros.environment import RosError, missing_ros

if TYPE_CHECKING:
    from typing_extensions import Self

    from tfcompose.observe.buffer import Buffer

# So many different complaints are logged at most, each once.
_MOST_COMPLAINTS = 200


class Listener:
    """Subscribes to TF and puts it into a buffer, until it is closed.

    Args:
        buffer: what is filled.
        node: an rclpy node; whoever spins it feeds the buffer. None: a node of its own with a thread of its own.
        spin_thread: spin the node that was handed over in a thread of the listener's.
        qos: an rclpy QoSProfile or a depth for /tf; default tf2's: reliable, volatile, the last 100.
        static_qos: the same for /tf_static; default tf2's: reliable, transient local, the last 100.
        tf_topic: the topic of moving edges.
        tf_static_topic: the topic of fixed edges.
        static_only: listen to fixed edges alone.
        namespace: listen to /NAMESPACE/tf and /NAMESPACE/tf_static instead.
        use_sim_time: the listener's own node follows /clock; a node that is handed over has its own parameter.

    When a node's clock goes back, as a simulator's or a bag's does, the buffer forgets all moving edges, and the node's
    log says so. What is refused is logged once for each frame and reason.

    Raises:
        RosError: if rclpy is not there or cannot be used.
    """

    def __init__(  # noqa: PLR0913 (tf2's arguments, and three)
        self,
        buffer: Buffer,
        node: Any = None,
        *,
        spin_thread: bool = False,
        qos: Any = None,
        static_qos: Any = None,
        tf_topic: str = "/tf",
        tf_static_topic: str = "/tf_static",
        static_only: bool = False,
        namespace: str = "",
        use_sim_time: bool = False,
    ) -> None:
        missing = missing_ros()
        if missing:
            raise RosError(missing)
        listening = import_module("tfcompose.ros.listening")
        prefix = f"/{namespace.strip('/')}" if namespace.strip("/") else ""
        topics = [listening.Topic(prefix + tf_static_topic, static=True, qos=static_qos)]
        if not static_only:
            topics.append(listening.Topic(prefix + tf_topic, static=False, qos=qos))
        self.buffer = buffer
        self.node = node
        self._decoder = Decoder()
        self._complaints: set[str] = set()
        if node is None:
            self._ear = listening.OwnEar(self._hear, topics, use_sim_time=use_sim_time)
            buffer.follow_clock(self._ear.node)
            self._ear.listen()
        else:
            self._ear = listening.GuestEar(node, self._hear, topics, spin=spin_thread)
            buffer.follow_clock(node)
            buffer.pollers.append(self._ear.poll)
        self._end = weakref.finalize(self, self._ear.close)  # at the latest when the program ends

    def unregister(self) -> None:
        """End the subscriptions; tf2's name for ``close``."""
        self.close()

    def close(self) -> None:
        """End the subscriptions, and the listener's own thread and node; the buffer keeps what it has."""
        poll = getattr(self._ear, "poll", None)
        if poll in self.buffer.pollers:
            self.buffer.pollers.remove(poll)
        self._end()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _hear(self, data: bytes, static: bool) -> None:  # noqa: FBT001 (called with what the subscription is)
        try:
            refused = self.buffer.insert(self._decoder.rows(data), static=static, authority="default_authority")
        except ValueError as error:
            self._complain(f"a message that is no TFMessage was dropped: {error}")
            return
        for child, reason in refused:
            self._complain(
                f"{reason.value}: a transform of {child or 'a frame without name'} was dropped: {reason.text}"
            )

    def _complain(self, complaint: str) -> None:
        if complaint not in self._complaints and len(self._complaints) < _MOST_COMPLAINTS:
            self._complaints.add(complaint)
            self._ear.node.get_logger().warning(complaint)


#: tf2_ros's name.
TransformListener = Listener
