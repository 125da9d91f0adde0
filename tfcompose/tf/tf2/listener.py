"""tf2_ros's ``TransformListener``: fills a buffer from /tf and /tf_static.

It requires rclpy.
"""

from __future__ import annotations

import weakref
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from typing_extensions import Self

    from tfcompose.tf.tf2.buffer import Buffer

# Maximum number of different warnings, each logged once.
_MOST_WARNINGS = 200


class TransformListener:
    """Subscribes to TF and fills a buffer, until it is closed.

    Args:
        buffer: the buffer to fill.
        node: an rclpy node; spinning it feeds the buffer. None: the listener creates a node with a
            thread.
        spin_thread: whether a thread of the listener spins the given node.
        qos: an rclpy QoSProfile or a depth for /tf; by default tf2's: reliable, volatile, the last
            100.
        static_qos: the same for /tf_static; by default tf2's: reliable, transient local, the last
            100.
        tf_topic: the topic of moving edges.
        tf_static_topic: the topic of fixed edges.
        static_only: whether to listen only to fixed edges.
        namespace: listen to /NAMESPACE/tf and /NAMESPACE/tf_static instead.
        use_sim_time: whether the listener's own node follows /clock; a given node has its own
            parameter.

    When a node's clock goes back, for example at the restart of a simulation or a bag, the buffer
    drops all moving edges, and the node's log reports it. Rejected transforms are logged once for
    each frame and reason.

    Raises:
        RosError: if rclpy is not installed or cannot be used.
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
        # ROS is optional.
        from tfcompose.tf.ros.environment import RosError, missing_ros  # noqa: PLC0415

        missing = missing_ros()
        if missing:
            raise RosError(missing)
        from tfcompose.tf.ros.tf_codec import Decoder  # noqa: PLC0415 (the same)

        # The same.
        from tfcompose.tf.ros.tf_listener import NodeListener, ThreadListener, TransformTopic  # noqa: PLC0415

        prefix = f"/{namespace.strip('/')}" if namespace.strip("/") else ""
        topics = [TransformTopic(prefix + tf_static_topic, static=True, qos=static_qos)]
        if not static_only:
            topics.append(TransformTopic(prefix + tf_topic, static=False, qos=qos))
        self.buffer = buffer
        self.node = node
        self._decoder = Decoder()
        self._warnings: set[str] = set()
        self._ros: NodeListener | ThreadListener
        if node is None:
            self._ros = ThreadListener(self._take, topics, use_sim_time=use_sim_time)
            buffer.follow_clock(self._ros.node)
            self._ros.start()
        else:
            self._ros = NodeListener(node, self._take, topics, spin=spin_thread)
            buffer.follow_clock(node)
            buffer.pollers.append(self._ros.poll)
        self._end = weakref.finalize(self, self._ros.close)  # when the program ends, at the latest

    def unregister(self) -> None:
        """Stop the subscriptions; tf2's name for ``close``."""
        self.close()

    def close(self) -> None:
        """Stop the subscriptions, and the listener's own thread and node.

        The buffer keeps its content.
        """
        poll = getattr(self._ros, "poll", None)
        if poll in self.buffer.pollers:
            self.buffer.pollers.remove(poll)
        self._end()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _take(self, data: bytes, static: bool) -> None:  # noqa: FBT001 (called with what the subscription is)
        try:
            rejected = self.buffer.insert(
                self._decoder.rows(data), static=static, authority="default_authority"
            )
        except ValueError as error:
            self._warn(f"a message that is no TFMessage was dropped: {error}")
            return
        for child, reason in rejected:
            self._warn(
                f"{reason.value}: a transform of {child or 'a frame without name'} was dropped:"
                f" {reason.text}"
            )

    def _warn(self, warning: str) -> None:
        if warning not in self._warnings and len(self._warnings) < _MOST_WARNINGS:
            self._warnings.add(warning)
            self._ros.node.get_logger().warning(warning)
