"""Sender of joint states from sliders, which sends only while no other node does."""

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

#: The time after which running publishers are nearly always discovered, and the interval of later
#: checks of the ROS graph, in seconds.
FOUND_S = 2.0
_ASK_EVERY_S = 0.25
#: The interval at which positions are sent, in seconds. The scene moves at the same interval.
_SEND_EVERY_S = 0.05


#: The largest position of a joint without limits, in rad or m.
_UNLIMITED = math.pi


class PositionPublisher(Protocol):
    """Publishes joint positions (rad or m), in the order of the names at its creation."""

    def publish(self, stamp_ns: int, positions: Sequence[float]) -> None:
        """Publish positions with this time stamp."""

    def close(self) -> None:
        """Close the publisher."""


def slider_range(joint: Joint) -> tuple[float, float]:
    """Return the lowest and the highest position of a joint's slider, in rad or m."""
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
    """Return the topics from which the plan's processes read joint states.

    Each topic maps the names of joints in its messages to names in the robot, which may have the
    prefix of a part.
    """
    topics: dict[str, dict[str, str]] = {}
    joints = {robot.final(edge.child): edge.joint.name for edge in robot.edges if edge.joint}
    for edge in plan.edges:
        if edge.kind == "joint" and edge.joint and edge.child in joints:
            topic = joint_states_topic(plan, edge)
            topics.setdefault(topic, {})[edge.joint.name] = joints[edge.child]
    return topics


@dataclass(slots=True)
class JointSender:
    """Sender of joint states on a topic.

    It first listens. If another node publishes on the topic, it sends nothing. If another node
    starts to publish later, it stops and does not start again.
    """

    topic: str
    #: The robot's joints, by their names in messages.
    names: Mapping[str, str]
    #: A function that creates the publisher.
    make: Callable[[], PositionPublisher]
    #: A function that returns the names of other nodes that publish on the topic.
    other_publishers: Callable[[], Sequence[str]]
    state: Literal["waiting", "sending", "refused", "stopped"] = "waiting"
    #: The other publishers at the time when the sender refused or stopped.
    publishers_found: tuple[str, ...] = ()
    _begun: float | None = None
    _ask_at: float = 0.0
    _send_at: float = 0.0
    _publisher: PositionPublisher | None = field(default=None, repr=False)

    @property
    def text(self) -> str:
        """The state of the sender, for display."""
        them = list_names(self.publishers_found)
        return {
            "waiting": f"looking whether anybody publishes {self.topic}",
            "sending": f"the sliders publish {self.topic}",
            "refused": f"the sliders do not publish: {them} publishes {self.topic}",
            "stopped": f"the sliders stopped publishing, as {them} publishes {self.topic}",
        }[self.state]

    def step(
        self, now: float, stamp_ns: int | None, robot: Robot, positions: Mapping[str, float]
    ) -> None:
        """Look for other publishers, or send positions, if it is time to do so.

        ``now`` is a time in seconds of any clock. ``stamp_ns`` is the stamp of the message.
        ``positions`` are the positions of sliders, in rad or m; mimic joints follow them.
        """
        self._begun = now if self._begun is None else self._begun
        if now >= self._ask_at:
            self._ask_at = now + _ASK_EVERY_S
            self._give_way(self.other_publishers())
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

    def _give_way(self, nodes: Sequence[str]) -> None:
        """Stop sending, and store the names of the other publishers.

        A node that has just started may not have a name yet.
        """
        if not nodes:
            return
        self.publishers_found = tuple(nodes)
        if self.state in {"waiting", "sending"}:
            self.state = "refused" if self.state == "waiting" else "stopped"
            self.close()

    def close(self) -> None:
        """Stop sending, and close the publisher."""
        if self._publisher is not None:
            self._publisher.close()
            self._publisher = None
