"""Where drivers say that their frames are, as the guard hears it.

A publisher is compared once for each frame, where the rmw says who sent a message.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from tfcompose.ipc import Found
from tfcompose.verdict.poses import Expected, driver_pose_differs, expected_of, is_off

if TYPE_CHECKING:
    from tfcompose.geometry import Pose
    from tfcompose.ipc import GuardEvent
    from tfcompose.plan import Plan
    from tfcompose.run.guard.senders import Message, Senders

#: So many frames of publishers without a name are kept at most.
_MOST = 1000


@dataclass(frozen=True, slots=True)
class Sent:
    """What a publisher sent of an expected frame."""

    expected: Expected
    pose: Pose
    gid: bytes
    static: bool


class SentPoses:
    """The frames that drivers publish, and what was sent of them."""

    def __init__(self, plan: Plan, senders: Senders) -> None:
        self._senders = senders
        self._expected = expected_of(plan)
        self._seen: set[tuple[bytes, str]] = set()
        self._waiting: list[Sent] = []

    def take(self, message: Message) -> None:
        """Note the poses that a message brings along."""
        if message.gid is None or not self._expected:
            return
        for (parent, child), pose in zip(message.edges, message.poses, strict=False):
            expected, key = self._expected.get(child), (message.gid, child)
            if expected is None or key in self._seen or parent != expected.edge.parent or len(self._seen) >= _MOST:
                continue
            self._seen.add(key)
            self._waiting.append(Sent(expected, pose, message.gid, message.static))

    def judge(self) -> list[GuardEvent]:
        """Return what drivers sent otherwise than their presets say, once for each driver and preset."""
        wrong: dict[tuple[str, str], list[tuple[Expected, Pose]]] = {}
        waiting = []
        for sent in self._waiting:
            nodes = self._senders.nodes(sent.gid, static=sent.static)
            if not nodes:
                waiting.append(sent)
            elif nodes == (sent.expected.edge.node,) and is_off(sent.expected, sent.pose):
                wrong.setdefault((nodes[0], sent.expected.driven.sensor), []).append((sent.expected, sent.pose))
        self._waiting = waiting
        return [Found(driver_pose_differs(node, off)) for (node, _), off in wrong.items()]
