"""Joint states from sliders, sent only if no other node sends them."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal, Protocol

from tfcompose.compiler.mounts.kinematics import joint_positions
from tfcompose.foundation.text import list_names
from tfcompose.model.plan.topics import joint_states_topic

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from tfcompose.model.plan import Plan
    from tfcompose.model.robot import Joint, Robot

#: Who publishes already is found within this time, or almost always; then the graph is asked so
#: often. Seconds.
FOUND_S = 2.0
_ASK_EVERY_S = 0.25
#: How often positions are sent, in seconds; what they move is seen as often.
_SEND_EVERY_S = 0.05


#: How far a joint without limits is moved, in rad or m.
_UNLIMITED = math.pi


class PositionPublisher(Protocol):
    """Publishes positions (rad or m) in the order of the names it was created with."""

    def publish(self, stamp_ns: int, positions: Sequence[float]) -> None:
        """Publish positions with this time stamp."""

    def close(self) -> None:
        """Leave the topic."""


def slider_range(joint: Joint) -> tuple[float, float]:
    """Return the range of a joint's slider, lowest and highest, in rad or m."""
    lower, upper = -_UNLIMITED, _UNLIMITED
    if joint.limit and joint.type != "continuous":
        lower = joint.limit.lower if joint.limit.lower is not None else lower
        upper = joint.limit.upper if joint.limit.upper is not None else upper
    return lower, max(lower, upper)


def first_positions(robot: Robot) -> dict[str, float]:
    """Return the initial positions of sliders: 0, or the nearest value within limits."""
    positions = {}
    for edge in robot.edges:
        if edge.joint and edge.joint.mimic is None:
            lower, upper = slider_range(edge.joint)
            positions[edge.joint.name] = min(max(0.0, lower), upper)
    return positions


def joint_topics(robot: Robot, plan: Plan) -> dict[str, dict[str, str]]:
    """Return the topics from which the plan's processes take joint states.

    Each with its joints by their names there. In the robot, a joint of a part may have the part's
    prefix.
    """
    found: dict[str, dict[str, str]] = {}
    joints = {robot.final(edge.child): edge.joint.name for edge in robot.edges if edge.joint}
    for edge in plan.edges:
        if edge.kind == "joint" and edge.joint and edge.child in joints:
            topic = joint_states_topic(plan, edge)
            found.setdefault(topic, {})[edge.joint.name] = joints[edge.child]
    return found


@dataclass(slots=True)
class JointSender:
    """Sender of joint states on one topic.

    It listens first, refuses if another node publishes there, and stops for good once another node
    does.
    """

    topic: str
    #: The robot's joints, by their names in messages.
    names: Mapping[str, str]
    #: Make the publisher.
    make: Callable[[], PositionPublisher]
    #: Return the names of other nodes that publish on the topic.
    others: Callable[[], Sequence[str]]
    state: Literal["waiting", "sending", "refused", "stopped"] = "waiting"
    #: The other publishers when it refused or stopped.
    others_found: tuple[str, ...] = ()
    _begun: float | None = None
    _ask_at: float = 0.0
    _send_at: float = 0.0
    _publisher: PositionPublisher | None = field(default=None, repr=False)

    @property
    def text(self) -> str:
        """The state of the sender, for display."""
        them = list_names(self.others_found)
        return {
            "waiting": f"looking whether anybody publishes {self.topic}",
            "sending": f"the sliders publish {self.topic}",
            "refused": f"the sliders do not publish: {them} publishes {self.topic}",
            "stopped": f"the sliders stopped publishing, as {them} publishes {self.topic}",
        }[self.state]

    def step(
        self, now: float, stamp_ns: int | None, robot: Robot, positions: Mapping[str, float]
    ) -> None:
        """Do the work due at ``now``, in seconds of any clock.

        Look for other publishers, or send positions with this stamp. ``positions`` are those of
        sliders, in rad or m; mimic joints follow.
        """
        self._begun = now if self._begun is None else self._begun
        if now >= self._ask_at:
            self._ask_at = now + _ASK_EVERY_S
            self._give_way(self.others())
        if self.state in {"refused", "stopped"}:
            return
        if self.state == "waiting" and now < self._begun + FOUND_S:
            return
        if self._publisher is None:
            self._publisher = self.make()
            self.state = "sending"
        if stamp_ns is not None and now >= self._send_at:
            self._send_at = now + _SEND_EVERY_S
            where = joint_positions(robot, positions)
            self._publisher.publish(stamp_ns, [where[name] for name in self.names.values()])

    def _give_way(self, others: Sequence[str]) -> None:
        """Leave the topic to others; a node that has just come may have no name yet."""
        if not others:
            return
        self.others_found = tuple(others)
        if self.state in {"waiting", "sending"}:
            self.state = "refused" if self.state == "waiting" else "stopped"
            self.close()

    def close(self) -> None:
        """Leave the topic."""
        if self._publisher is not None:
            self._publisher.close()
            self._publisher = None
