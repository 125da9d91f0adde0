"""Watches joint states: each joint must belong to the robot and have a single publisher.

TF does not reveal two publishers of joint states, because a single node publishes the joint's
edge. The topics are polled, so that their messages do not wake the guard.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from tfcompose.guard.verdict.joints import find_sent_twice, planned_joints, unknown_joints
from tfcompose.model.messages import FindingShown, RecoveredShown
from tfcompose.model.plan.topics import joint_states_topics
from tfcompose.tf.live.joint_states import JointStates
from tfcompose.tf.ros.clock import wall_ns

if TYPE_CHECKING:
    from collections.abc import Callable

    from rclpy.node import Node

    from tfcompose.foundation.findings import Finding
    from tfcompose.model.messages import GuardEvent
    from tfcompose.model.plan import Plan

#: Interval between reads of the topics, in seconds.
READ_EVERY_S = 0.5
#: A node that sends nothing for this time, in nanoseconds, no longer counts as a sender.
SENDS_NO_MORE_NS = 3_000_000_000


class JointWatch:
    """Judges the topics from which the plan's publishers receive joint states."""

    def __init__(self, node: Node, plan: Plan, emit: Callable[[GuardEvent], None]) -> None:
        self._topics = [JointStates(node, name) for name in joint_states_topics(plan)]
        self._joints = planned_joints(plan)
        self._emit = emit
        self._due = 0.0
        #: Reported faults that are still open, by code and message.
        self._wrong: dict[tuple[str, str], Finding] = {}

    def wrong(self) -> list[Finding]:
        """Return the open findings."""
        return list(self._wrong.values())

    def check(self) -> None:
        """Read messages when due, and report new and resolved findings."""
        if not self._topics or time.monotonic() < self._due:
            return
        self._due = time.monotonic() + READ_EVERY_S
        by_joint = {}
        for states in self._topics:
            states.take()
            states.forget(wall_ns() - SENDS_NO_MORE_NS)
            senders = states.sent_joints()
            for wrong in (*find_sent_twice(senders), *unknown_joints(senders, self._joints)):
                by_joint[wrong.code, wrong.message] = wrong
        for key, wrong in by_joint.items():
            if key not in self._wrong:
                self._emit(FindingShown(wrong))
        for key, wrong in self._wrong.items():
            if key not in by_joint:
                self._emit(RecoveredShown(f"no longer: {wrong.message}"))
        self._wrong = by_joint
