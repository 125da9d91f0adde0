"""The action tf2_msgs/LookupTransform of a buffer server."""

from __future__ import annotations

from importlib.util import find_spec
from threading import Event
from time import monotonic
from typing import TYPE_CHECKING, Any

from rclpy.action.client import ActionClient

from tfcompose.tf.ros.environment import RosError

if TYPE_CHECKING:
    from rclpy.node import Node

_SECOND_NS = 1_000_000_000


class LookupAction:
    """A client of a buffer server's action.

    Raises:
        RosError: if tf2_msgs is not installed.
    """

    def __init__(self, node: Node, name: str) -> None:
        if find_spec("tf2_msgs") is None:
            raise RosError(
                "a buffer server is asked with tf2_msgs, which a ROS distribution has and PyPI"
                " has not"
            )
        # The wheels from PyPI lack it.
        from tf2_msgs.action import LookupTransform  # noqa: PLC0415

        self._type = LookupTransform
        self._name = name
        client: Any = ActionClient  # rclpy does not say the types of its arguments
        self.client = client(node, LookupTransform, action_name=name)

    def goal(self, target: str, source: str, source_ns: int, timeout_ns: int) -> Any:
        """Return the goal for the source's pose in the target at the same time, in nanoseconds."""
        goal = self._type.Goal()
        goal.target_frame, goal.source_frame, goal.advanced = target, source, False
        goal.source_time.sec, goal.source_time.nanosec = divmod(source_ns, _SECOND_NS)
        goal.timeout.sec, goal.timeout.nanosec = divmod(timeout_ns, _SECOND_NS)
        return goal

    @staticmethod
    def set_fixed_frame(goal: Any, fixed: str, target_ns: int) -> None:
        """Make the goal request the target at another time, through a fixed frame."""
        goal.fixed_frame, goal.advanced = fixed, True
        goal.target_time.sec, goal.target_time.nanosec = divmod(target_ns, _SECOND_NS)

    def result(self, goal: Any, timeout_s: float) -> Any:
        """Return the server's result, or the reason as a string if there was none in time.

        Another thread must spin the node.
        """
        end = monotonic() + timeout_s
        if not self.client.server_is_ready():
            return f"no buffer server offers {self._name}"
        sent = self.client.send_goal_async(goal)
        if not _wait_until_done(sent, end):
            return f"the buffer server {self._name} did not take the query in {timeout_s:g} s"
        handle = sent.result()
        if not handle.accepted:
            return f"the buffer server {self._name} refused the query"
        answer = handle.get_result_async()
        if not _wait_until_done(answer, end):
            return f"the buffer server {self._name} did not answer in {timeout_s:g} s"
        return answer.result().result


def _wait_until_done(future: Any, end: float) -> bool:
    """Wait until the future is done; return False if the time runs out first."""
    done = Event()
    future.add_done_callback(lambda _: done.set())
    return done.wait(max(0.0, end - monotonic()))
