"""The client of a buffer server, against a server of the test's own: PyPI has no tf2_msgs."""

import sys
import threading
from collections.abc import Callable
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest
from geometry_msgs.msg import PointStamped
from rclpy import task
from rclpy.duration import Duration
from rclpy.time import Time

from tfcompose.foundation.geometry import Pose
from tfcompose.tf.ros import tf_action
from tfcompose.tf.ros.environment import RosError
from tfcompose.tf.tf2 import (
    Buffer,
    BufferClient,
    ConnectivityException,
    ExtrapolationException,
    InvalidArgumentException,
    LookupException,
    TimeoutException,
    TransformException,
)
from tfcompose.tf.tf2.messages import nanoseconds

S = 1_000_000_000
_Future: Any = task.Future  # rclpy does not say its types
CODES: dict[type[Exception], int] = {
    LookupException: 1,
    ConnectivityException: 2,
    ExtrapolationException: 3,
    InvalidArgumentException: 4,
    TimeoutException: 5,
    TransformException: 6,
}


class Goal(SimpleNamespace):
    """tf2_msgs/LookupTransform's goal."""

    def __init__(self) -> None:
        super().__init__(
            source_time=SimpleNamespace(), target_time=SimpleNamespace(), timeout=SimpleNamespace()
        )


class Server:
    """Answers from a buffer, in a thread of its own; what it ``does_not``, it leaves out."""

    def __init__(self) -> None:
        self.buffer = Buffer()
        self.goals: list[Any] = []
        self.does_not = ""
        self.fails: TransformException | None = None

    def server_is_ready(self) -> bool:
        return self.does_not != "exist"

    def send_goal_async(self, goal: Any) -> Any:
        self.goals.append(goal)
        handle = SimpleNamespace(
            accepted=self.does_not != "accept",
            get_result_async=lambda: self._later(lambda: self._answer(goal), "answer"),
        )
        return self._later(lambda: handle, "take")

    def destroy(self) -> None:
        self.does_not = "exist"

    def _later(self, make: Callable[[], Any], step: str) -> Any:
        future: Any = _Future()
        if step != self.does_not:
            threading.Timer(0.01, lambda: future.set_result(make())).start()
        return future

    def _answer(self, goal: Any) -> Any:
        error, transform = SimpleNamespace(error=0, error_string=""), None
        try:
            if self.fails:
                raise self.fails
            if goal.advanced:
                query = (
                    goal.target_frame,
                    goal.target_time,
                    goal.source_frame,
                    goal.source_time,
                    goal.fixed_frame,
                )
                transform = self.buffer.lookup_transform_full_core(*query)
            else:
                transform = self.buffer.lookup_transform_core(
                    goal.target_frame, goal.source_frame, goal.source_time
                )
        except TransformException as raised:
            error = SimpleNamespace(error=CODES[type(raised)], error_string=str(raised))
        return SimpleNamespace(result=SimpleNamespace(error=error, transform=transform))


@pytest.fixture
def server(monkeypatch: pytest.MonkeyPatch) -> Server:
    """A robot that drives 1 m/s from second 1 to 5, with a laser."""
    server = Server()
    for second in (1, 5):
        server.buffer.set("odom", "base", Pose((float(second), 0, 0)), second * S, static=False)
    server.buffer.set("base", "laser", Pose((0.5, 0, 0)), 0, static=True)
    messages, actions = ModuleType("tf2_msgs"), ModuleType("tf2_msgs.action")
    messages.__spec__ = SimpleNamespace()  # type: ignore[assignment]
    actions.LookupTransform = SimpleNamespace(Goal=Goal)  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "tf2_msgs", messages)
    monkeypatch.setitem(sys.modules, "tf2_msgs.action", actions)
    monkeypatch.setattr(
        tf_action,
        "ActionClient",
        lambda _node, _type, **names: server if names["action_name"] else None,
    )
    return server


def client(timeout_padding: Any = 60.0) -> BufferClient:
    return BufferClient(None, "/tf_action", check_frequency=10.0, timeout_padding=timeout_padding)


def test_lookups_are_answered_by_the_servers_buffer(server: Server) -> None:
    stamped = client().lookup_transform("odom", "laser", Time(seconds=2), Duration(seconds=1.5))
    assert stamped == server.buffer.lookup_transform("odom", "laser", Time(seconds=2))
    assert [
        nanoseconds(time) for time in (server.goals[0].source_time, server.goals[0].timeout)
    ] == [2 * S, 1.5 * S]
    full = client().lookup_transform_full(
        "base", Time(seconds=4), "laser", Time(seconds=2), "odom"
    )
    assert full.transform.translation.x == -1.5
    assert client().can_transform("odom", "laser", Time())
    assert client().can_transform_full("base", Time(), "laser", Time(), "odom")
    assert not client().can_transform("odom", "lidar", Time())
    assert not client().can_transform_full("base", Time(), "laser", Time(seconds=9), "odom")


@pytest.mark.usefixtures("server")
def test_messages_are_moved_through_the_server() -> None:
    point = PointStamped()
    point.header.frame_id, point.header.stamp = "laser", Time(seconds=2).to_msg()
    assert client().transform(point, "odom", Duration(seconds=1)).point.x == 2.5


@pytest.mark.parametrize("kind", CODES)
def test_the_servers_error_is_raised_as_tf2s_exception(
    server: Server, kind: type[TransformException]
) -> None:
    server.fails = kind("because of this")
    with pytest.raises(TransformException, match="because of this") as raised:
        client().lookup_transform("odom", "laser", Time())
    assert type(raised.value) is kind


@pytest.mark.parametrize("step", ["exist", "take", "accept", "answer"])
def test_an_unresponsive_server_is_awaited_no_longer_than_allowed(
    server: Server, step: str
) -> None:
    server.does_not = step
    with pytest.raises(TimeoutException, match="/tf_action"):
        client(Duration(seconds=0.1)).lookup_transform("odom", "laser", Time())
    assert not client(0.1).can_transform("odom", "laser", Time())


def test_a_client_that_is_destroyed_has_no_server(server: Server) -> None:
    ended = client()
    ended.destroy()
    assert server.does_not == "exist"
    with pytest.raises(TimeoutException):
        ended.lookup_transform("odom", "laser", Time())


def test_without_tf2_msgs_it_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "tf2_msgs", None)  # as if it were not installed, where it is
    with pytest.raises(RosError, match="tf2_msgs"):
        client()
