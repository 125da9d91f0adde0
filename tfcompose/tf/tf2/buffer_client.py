"""tf2_ros's ``BufferClient``: lookups in the buffer of a buffer server.

It requires rclpy and tf2_msgs.
"""

from __future__ import annotations

from typing import Any

from tfcompose.tf.tf2.buffer import BufferInterface
from tfcompose.tf.tf2.exceptions import (
    ConnectivityException,
    ExtrapolationException,
    InvalidArgumentException,
    LookupException,
    TimeoutException,
    TransformException,
)
from tfcompose.tf.tf2.messages import nanoseconds

# tf2_msgs/TF2Error: NO_ERROR is 0, and any other number is a TransformException.
_EXCEPTIONS = {
    1: LookupException,
    2: ConnectivityException,
    3: ExtrapolationException,
    4: InvalidArgumentException,
    5: TimeoutException,
}


class BufferClient(BufferInterface):
    """Looks up transforms with the action tf2_msgs/LookupTransform.

    Another thread must spin the node meanwhile.

    Args:
        node: an rclpy node.
        ns: the action's name.
        check_frequency: ignored, for compatibility with tf2; an answer returns at once.
        timeout_padding: how much longer than a lookup's timeout its answer may take, a duration,
            or seconds as a float.

    Raises:
        RosError: if tf2_msgs is not installed.
    """

    def __init__(
        self, node: Any, ns: str, check_frequency: float = 10.0, timeout_padding: Any = 2.0
    ) -> None:
        # A program with a node has ROS.
        from tfcompose.tf.ros.tf_action import LookupAction  # noqa: PLC0415

        super().__init__()
        self.node = node
        self.check_frequency = check_frequency
        self.timeout_padding = timeout_padding
        self._action = LookupAction(node, ns)
        #: rclpy's action client, for ``wait_for_server``.
        self.action_client = self._action.client

    def lookup_transform(
        self, target_frame: str, source_frame: str, time: Any, timeout: Any = 0
    ) -> Any:
        """Return the server's pose of ``source_frame`` in ``target_frame`` at a time.

        Raises:
            TimeoutException: if there is no server, or it does not answer.
            TransformException: if there is no such transform; its subclasses as ``Buffer`` raises
                them.
        """
        goal = self._action.goal(
            target_frame, source_frame, nanoseconds(time), nanoseconds(timeout)
        )
        return self._answer(goal, timeout)

    def lookup_transform_full(  # noqa: PLR0913, PLR0917 (tf2's arguments)
        self,
        target_frame: str,
        target_time: Any,
        source_frame: str,
        source_time: Any,
        fixed_frame: str,
        timeout: Any = 0,
    ) -> Any:
        """Return the server's pose of the source at a time in the target at another time.

        Raises:
            TransformException: as in ``lookup_transform``.
        """
        goal = self._action.goal(
            target_frame, source_frame, nanoseconds(source_time), nanoseconds(timeout)
        )
        self._action.set_fixed_frame(goal, fixed_frame, nanoseconds(target_time))
        return self._answer(goal, timeout)

    def can_transform(
        self, target_frame: str, source_frame: str, time: Any, timeout: Any = 0
    ) -> bool:
        """Return whether ``lookup_transform`` would succeed."""
        try:
            self.lookup_transform(target_frame, source_frame, time, timeout)
        except TransformException:
            return False
        return True

    def can_transform_full(  # noqa: PLR0913, PLR0917 (tf2's arguments)
        self,
        target_frame: str,
        target_time: Any,
        source_frame: str,
        source_time: Any,
        fixed_frame: str,
        timeout: Any = 0,
    ) -> bool:
        """Return whether ``lookup_transform_full`` would succeed."""
        try:
            self.lookup_transform_full(
                target_frame, target_time, source_frame, source_time, fixed_frame, timeout
            )
        except TransformException:
            return False
        return True

    def destroy(self) -> None:
        """Destroy the action's client; the node stays."""
        self.action_client.destroy()

    def _answer(self, goal: Any, timeout: Any) -> Any:
        padding = self.timeout_padding
        padding_s = padding if isinstance(padding, float) else nanoseconds(padding) / 1e9
        result = self._action.result(goal, nanoseconds(timeout) / 1e9 + padding_s)
        if isinstance(result, str):
            raise TimeoutException(result)
        if result.error.error:
            raise _EXCEPTIONS.get(result.error.error, TransformException)(
                result.error.error_string
            )
        return result.transform
