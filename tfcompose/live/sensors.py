"""What comes besides TF and needs it: headers of sensor data, joint states, the robot's description."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar
from xml.parsers import expat

from tfcompose.live.state import MovingJoint, StampedData
from tfcompose.ros.joint_codec import read_names
from tfcompose.ros.node import LATCHED, TextSubscription
from tfcompose.ros.sensor_data import HEADED, JOINT_STATE_TYPE, HeaderSubscription, JointStateSubscription

if TYPE_CHECKING:
    from collections.abc import Iterable

    from rclpy.node import Node

    from tfcompose.live.state import Topic


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


#: Joints that a state moves.
MOVING = frozenset({"revolute", "continuous", "prismatic"})


class _Reader:
    """Reads the joints of a URDF; a document that declares a type or entities is not read on."""

    def __init__(self) -> None:
        self.joints: list[MovingJoint] = []
        self._depth = 0
        self._joint: dict[str, str] = {}
        self._parser = expat.ParserCreate()
        self._parser.StartElementHandler = self._start
        self._parser.EndElementHandler = self._end
        self._parser.StartDoctypeDeclHandler = self._refuse

    def read(self, text: str) -> None:
        try:
            self._parser.Parse(text, True)  # noqa: FBT003 (expat's: this is all)
        except (expat.ExpatError, ValueError):
            self.joints.clear()

    def _start(self, name: str, attributes: dict[str, str]) -> None:
        self._depth += 1
        if self._depth == 2 and name == "joint":  # noqa: PLR2004 (below <robot>)
            self._joint = {"name": attributes.get("name", ""), "type": attributes.get("type", "")}
        elif name in {"parent", "child"} and self._joint:
            self._joint[name] = attributes.get("link", "")
        elif name == "mimic" and self._joint:
            self._joint["mimic"] = "yes"

    def _end(self, name: str) -> None:
        if self._depth == 2 and name == "joint" and self._joint.get("type") in MOVING:  # noqa: PLR2004
            joint = self._joint
            self.joints.append(
                MovingJoint(joint["name"], joint.get("parent", ""), joint.get("child", ""), "mimic" in joint)
            )
        if self._depth == 2:  # noqa: PLR2004
            self._joint = {}
        self._depth -= 1

    def _refuse(self, *_: object) -> None:
        raise ValueError


def joints_of(description: str) -> tuple[MovingJoint, ...]:
    """Return the moving joints of a URDF; none where it is none."""
    reader = _Reader()
    reader.read(description)
    return tuple(reader.joints)
