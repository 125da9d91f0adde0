"""What comes besides TF and needs it: headers of sensor data, joint states, the robot's description."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from tfcompose.live.joints import joints_of
from tfcompose.live.state import StampedData
from tfcompose.ros.headers import HEADED, HeaderSubscription
from tfcompose.ros.joint_codec import read_names
from tfcompose.ros.joint_states import JOINT_STATE_TYPE, JointStateSubscription
from tfcompose.ros.node import LATCHED, TextSubscription

if TYPE_CHECKING:
    from collections.abc import Iterable

    from rclpy.node import Node

    from tfcompose.live.state import MovingJoint, Topic

#: So many headers say what a topic's are like; then it is not listened to any more, as data may be large.
ENOUGH = 20
#: So many topics are listened to.
MOST = 100


class SensorTopics:
    """Listens to what is below a namespace, for a while.

    ``moving_joints`` are those of the newest description, ``joint_names`` those that had a state.
    """

    TYPES: ClassVar = frozenset({*HEADED, JOINT_STATE_TYPE})

    def __init__(self, node: Node, prefix: str) -> None:
        self._node = node
        self._prefix = prefix
        self._description = TextSubscription(node, f"{prefix}/robot_description", LATCHED)
        self._headers: dict[str, HeaderSubscription | None] = {}
        self._joints: dict[str, JointStateSubscription] = {}
        self._delays: dict[tuple[str, str], list[float]] = {}
        self._newest: dict[tuple[str, str], tuple[int, int]] = {}  # stamp and arrival
        self._senders: dict[str, tuple[str, ...]] = {}
        self.moving_joints: tuple[MovingJoint, ...] = ()
        self.joint_names: set[str] = set()

    def subscribe(self, graph: Iterable[Topic], robots_inside: tuple[str, ...]) -> None:
        """Listen to topics that are new; not to those of robots inside, which have TF topics of their own."""
        for topic in graph:
            inside = topic.name.startswith(f"{self._prefix}/") and not topic.name.startswith(
                tuple(f"{name}/" for name in robots_inside)
            )
            if not inside or not topic.publishers:
                continue
            if topic.type in HEADED:
                self._senders[topic.name] = topic.publishers
                if topic.name not in self._headers and len(self._headers) < MOST:
                    self._headers[topic.name] = HeaderSubscription(self._node, topic.name, topic.type)
            elif topic.type == JOINT_STATE_TYPE and topic.name not in self._joints and len(self._joints) < MOST:
                self._joints[topic.name] = JointStateSubscription(self._node, topic.name)

    def take(self, clock_ns: int | None) -> None:
        """Take what has come; ``clock_ns`` is the newest simulated time, None where there is none."""
        for topic, subscription in self._headers.items():
            taken = subscription.take_headers() if subscription else []
            for frame, stamp_ns, received_ns in taken:
                times = [received_ns] if clock_ns is None else [received_ns, clock_ns]
                delay_ns = min((time - stamp_ns for time in times), key=abs)
                self._delays.setdefault((topic, frame), []).append(delay_ns / 1e9)
                self._newest[topic, frame] = (stamp_ns, received_ns)
            heard = sum(len(some) for (name, _), some in self._delays.items() if name == topic) if taken else 0
            if subscription and heard >= ENOUGH:
                self._end(subscription)
                self._headers[topic] = None
        for joints in self._joints.values():
            for received in joints.take()[-1:]:
                self.joint_names |= _names(received.data)
        for _, text in self._description.take_texts()[-1:]:
            self.moving_joints = joints_of(text)

    def stamped(self) -> tuple[StampedData, ...]:
        """Return what came with a header, by topic and frame."""
        return tuple(
            StampedData(topic, frame, self._senders.get(topic, ()), tuple(delays), *self._newest[topic, frame])
            for (topic, frame), delays in sorted(self._delays.items())
        )

    def _end(self, subscription: HeaderSubscription) -> None:
        self._node.destroy_subscription(subscription.subscription)


def _names(data: bytes) -> frozenset[str]:
    try:
        return frozenset(read_names(data).names)
    except ValueError:
        return frozenset()
