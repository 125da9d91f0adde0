"""What is kept of joint states: the newest lists of names of each publisher, no more."""

from __future__ import annotations

from typing import TYPE_CHECKING, cast

import pytest

from tfcompose.tf.live import joint_states
from tfcompose.tf.live.joint_states import MOST_LISTS, JointStates
from tfcompose.tf.ros.joint_codec import encode_names
from tfcompose.tf.ros.node import Received

if TYPE_CHECKING:
    from rclpy.node import Node


class Messages:
    """A subscription whose messages a test gives."""

    def __init__(self) -> None:
        self.waiting: list[Received] = []

    def come(self, at_ns: int, *names: str) -> None:
        data = bytes(encode_names(names))
        self.waiting.append(Received(data, b"1", at_ns, at_ns, 0))

    def take(self) -> list[Received]:
        taken, self.waiting = self.waiting, []
        return taken


@pytest.fixture
def messages(monkeypatch: pytest.MonkeyPatch) -> Messages:
    messages = Messages()
    monkeypatch.setattr(joint_states, "JointStateSubscription", lambda *_: messages)
    monkeypatch.setattr(joint_states, "writers", lambda *_: [])
    return messages


def joints_of(states: JointStates) -> set[str]:
    states.take()
    return {joint for sent in states.sent_joints() for joint in sent.joints}


def test_a_publisher_of_ever_new_names_takes_bounded_memory(messages: Messages) -> None:
    states = JointStates(cast("Node", None), "/joint_states")
    for number in range(3 * MOST_LISTS):
        messages.come(number + 1, f"joint_{number}")
    kept = joints_of(states)
    assert len(kept) == MOST_LISTS
    assert f"joint_{3 * MOST_LISTS - 1}" in kept


def test_a_joint_that_is_sent_no_more_is_forgotten(messages: Messages) -> None:
    states = JointStates(cast("Node", None), "/joint_states")
    messages.come(1, "left", "right")
    messages.come(2, "arm")
    messages.come(3, "left", "right")
    assert joints_of(states) == {"left", "right", "arm"}
    states.forget(3)
    assert joints_of(states) == {"left", "right"}
    states.forget(4)
    assert not joints_of(states)
