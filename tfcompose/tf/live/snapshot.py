"""Observation of the running system for a time; returns the state that the doctor judges.

In addition to TF it observes data of TF's consumers: headers of sensor data, joint states, and the
robot description.
"""

from __future__ import annotations

import os
import time
from dataclasses import replace
from typing import TYPE_CHECKING, ClassVar
from xml.parsers import expat

from tfcompose.model.plan.topics import GLOBAL
from tfcompose.tf.live.edges import SETTLE_S, TreeObserver
from tfcompose.tf.live.feed import follow
from tfcompose.tf.live.joint_states import JointStates
from tfcompose.tf.live.ros_feed import RosFeed
from tfcompose.tf.live.state import (
    MovingJoint,
    RosProcess,
    StampedData,
    TopicState,
    TreeState,
)
from tfcompose.tf.ros.environment import RMW
from tfcompose.tf.ros.graph import ends, nodes, topics, volatile_readers
from tfcompose.tf.ros.joint_codec import JOINT_STATE_TYPE
from tfcompose.tf.ros.node import LATCHED, TextSubscription, middleware
from tfcompose.tf.ros.processes import ros_processes, ros_variables
from tfcompose.tf.ros.sensor_data import (
    HEADED,
    HeaderSubscription,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from rclpy.node import Node

    from tfcompose.foundation.signals import Stop
    from tfcompose.model.plan import Plan
    from tfcompose.tf.live.ros_feed import TreeListener
    from tfcompose.tf.live.sent_joints import SentJoints

    Topics = tuple[str, str]


#: Number of headers to read from a topic. Afterwards the subscription is closed, because the data
#: may be large.
ENOUGH = 20
#: Maximum number of topics to subscribe to.
MOST = 100


class SensorTopics:
    """Subscriptions to the topics below a namespace.

    ``moving_joints`` are the moving joints of the newest description.
    """

    TYPES: ClassVar = frozenset({*HEADED, JOINT_STATE_TYPE})

    def __init__(self, node: Node, prefix: str) -> None:
        self._node = node
        self._prefix = prefix
        self._description = TextSubscription(node, f"{prefix}/robot_description", LATCHED)
        self._headers: dict[str, HeaderSubscription | None] = {}
        self._joints: dict[str, JointStates] = {}
        self._delays: dict[tuple[str, str], list[float]] = {}
        self._newest: dict[tuple[str, str], tuple[int, int]] = {}  # stamp and arrival
        self._senders: dict[str, tuple[str, ...]] = {}
        self.moving_joints: tuple[MovingJoint, ...] = ()

    def subscribe(self, graph: Iterable[TopicState], robots_inside: tuple[str, ...]) -> None:
        """Subscribe to new topics.

        Topics of robots below this namespace, which have their own TF topics, are excluded.
        """
        for topic in graph:
            inside = topic.name.startswith(f"{self._prefix}/") and not topic.name.startswith(
                tuple(f"{name}/" for name in robots_inside)
            )
            if not inside or not topic.publishers:
                continue
            if topic.type in HEADED:
                self._senders[topic.name] = topic.publishers
                if topic.name not in self._headers and len(self._headers) < MOST:
                    self._headers[topic.name] = HeaderSubscription(
                        self._node, topic.name, topic.type
                    )
            elif (
                topic.type == JOINT_STATE_TYPE
                and topic.name not in self._joints
                and len(self._joints) < MOST
            ):
                self._joints[topic.name] = JointStates(self._node, topic.name)

    def take(self, clock_ns: int | None) -> None:
        """Read pending messages; ``clock_ns`` is the newest simulated time or None."""
        for topic, subscription in self._headers.items():
            headers = subscription.take_headers() if subscription else []
            for frame, stamp_ns, received_ns in headers:
                times = [received_ns] if clock_ns is None else [received_ns, clock_ns]
                delay_ns = min((time - stamp_ns for time in times), key=abs)
                self._delays.setdefault((topic, frame), []).append(delay_ns / 1e9)
                self._newest[topic, frame] = (stamp_ns, received_ns)
            heard = (
                sum(len(some) for (name, _), some in self._delays.items() if name == topic)
                if headers
                else 0
            )
            if subscription and heard >= ENOUGH:
                self._end(subscription)
                self._headers[topic] = None
        for joints in self._joints.values():
            joints.take()
        for _, text in self._description.take_texts()[-1:]:
            self.moving_joints = joints_of(text)

    def stamped_data(self) -> tuple[StampedData, ...]:
        """Return the received messages with a header, by topic and frame."""
        return tuple(
            StampedData(
                topic,
                frame,
                self._senders.get(topic, ()),
                tuple(delays),
                *self._newest[topic, frame],
            )
            for (topic, frame), delays in sorted(self._delays.items())
        )

    def sent_joints(self) -> tuple[SentJoints, ...]:
        """Return the senders of joint states, with their joints."""
        return tuple(sent for joints in self._joints.values() for sent in joints.sent_joints())

    def _end(self, subscription: HeaderSubscription) -> None:
        self._node.destroy_subscription(subscription.subscription)


#: Types of joints that joint states move.
MOVING = frozenset({"revolute", "continuous", "prismatic"})


class _JointReader:
    """Reads the joints of a URDF. Stops at a document type or an entity."""

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
                MovingJoint(
                    joint["name"],
                    joint.get("parent", ""),
                    joint.get("child", ""),
                    "mimic" in joint,
                )
            )
        if self._depth == 2:  # noqa: PLR2004
            self._joint = {}
        self._depth -= 1

    def _refuse(self, *_: object) -> None:
        raise ValueError


def joints_of(description: str) -> tuple[MovingJoint, ...]:
    """Return the moving joints of a URDF; empty if it is not one."""
    reader = _JointReader()
    reader.read(description)
    return tuple(reader.joints)


WAIT_S = 0.05
ASK_EVERY_S = 0.5
#: /clock counts as stopped after this time in seconds. Simulators and players publish it much more
#: often.
CLOCK_STANDS_S = 2.0
#: Prefixes of nodes of observing tools, such as this one. They are ignored, unless a plan contains
#: them.
TOOLS = ("/tfcompose_", "/_ros2cli_")
#: Types of topics that are observed in addition to TF itself.
INTERESTING = ("tf2_msgs/msg/TFMessage", "rosgraph_msgs/msg/Clock", "sensor_msgs/msg/JointState")


def observe(expected: Mapping[Topics, Plan | None], seconds: float, stop: Stop) -> list[TreeState]:
    """Observe the topics (moving, fixed) for this many seconds, or until ``stop`` is requested.

    Each pair of topics may have a plan with the expected edges. Return a state for each pair.

    Raises:
        RosError: if ROS cannot start a node or receive messages.
    """
    observers = {pair: TreeObserver(0.0, SETTLE_S) for pair in expected}
    with RosFeed("tfcompose_doctor", observers) as feed:
        node = feed.node
        views = [_TopicPair(listener) for listener in feed.listeners]
        graph: dict[str, TopicState] = {}
        robot = _robot_nodes(expected.values())
        due = 0.0

        def scan() -> None:
            """Take what came besides TF, and from time to time who is there."""
            nonlocal due
            for view in views:
                view.take()
            if time.monotonic() >= due:
                due = time.monotonic() + ASK_EVERY_S
                graph.update(topics_in(node, robot))
                for view in views:
                    view.sensors.subscribe(graph.values(), _robots_inside(view, graph))

        scan()
        listened_s = follow(feed, stop, duration_s=seconds, every_s=WAIT_S, show=scan)
        for view in views:
            view.take()
        # The newest endpoints replace earlier ones, but topics that have vanished are kept.
        graph |= topics_in(node, robot)
        common = TreeState(
            listened_s,
            nodes=tuple(name for name in nodes(node) if not _is_tool(name, robot)),
            graph=tuple(graph.values()),
            settings=own_settings(),
            processes=tuple(RosProcess(*process) for process in ros_processes()),
        )
        return [
            replace(view.state(common), plan=plan)
            for view, plan in zip(views, expected.values(), strict=True)
        ]


class _TopicPair:
    """Observations on one pair of topics, and below its namespace."""

    def __init__(self, listener: TreeListener) -> None:
        self.listener = listener
        self.topics = listener.topics
        self.namespace = self.topics[0].removesuffix("/tf")
        self.sensors = SensorTopics(listener.node, self.namespace)
        #: The newest time on /clock, and the monotonic time of its last change; 0 before the
        #: first.
        self._clock: tuple[int | None, float] = (None, 0.0)
        self._taken_at = 0.0

    def take(self) -> None:
        """Read pending messages other than TF."""
        clock_ns, self._taken_at = self.listener.clock_ns, time.monotonic()
        if clock_ns != self._clock[0]:
            self._clock = (clock_ns, 0.0 if self._clock[0] is None else self._taken_at)
        self.sensors.take(clock_ns)

    def state(self, common: TreeState) -> TreeState:
        observer = self.listener.observer
        return replace(
            common,
            topics=self.topics,
            edges=tuple(observer.edges(observer.until_ns)),
            publishers=tuple(self.listener.graph.publishers()),
            volatile_readers=tuple(
                name
                for name in volatile_readers(self.listener.node, self.topics[1])
                if not name.startswith(TOOLS)
            ),
            malformed=dict(observer.malformed),
            beyond=dict(observer.beyond),
            sent=dict(observer.sent),
            clock_ns=self.listener.clock_ns,
            clock_moves=self._clock[1] > self._taken_at - CLOCK_STANDS_S,
            skews_s=self.listener.skews_s,
            stamped=self.sensors.stamped_data(),
            moving_joints=self.sensors.moving_joints,
            sent_joints=self.sensors.sent_joints(),
        )


def _robot_nodes(plans: Iterable[Plan | None]) -> frozenset[str]:
    """Return the nodes of the plans' processes, except guards, which look like tools."""
    return frozenset(
        node
        for plan in plans
        if plan is not None
        for process in plan.processes
        if process.kind != "guard"
        for node in process.nodes
    )


def _is_tool(name: str, robot: frozenset[str]) -> bool:
    return name.startswith(TOOLS) and name not in robot


def topics_in(node: Node, robot: frozenset[str] = frozenset()) -> dict[str, TopicState]:
    """Return the topics that are relevant to TF with their endpoints, by name and type.

    Endpoints of tools are excluded, except nodes of the ``robot``.
    """
    names = {}
    for name, types in topics(node):
        if name not in GLOBAL and not set(types) & {*INTERESTING, *SensorTopics.TYPES}:
            continue
        both = [end for end in ends(node, name) if not _is_tool(end[0], robot)]
        for kind in types:
            senders = tuple(
                dict.fromkeys(who for who, type_, sends in both if sends and type_ == kind)
            )
            readers = tuple(
                dict.fromkeys(who for who, type_, sends in both if not sends and type_ == kind)
            )
            if senders or readers:
                names[f"{name} {kind}"] = TopicState(name, kind, senders, readers)
    return names


def _robots_inside(view: _TopicPair, graph: dict[str, TopicState]) -> tuple[str, ...]:
    """Return the namespaces below this namespace of robots with their own TF topics."""
    names = {
        topic.name.removesuffix("/tf")
        for topic in graph.values()
        if topic.name.endswith("/tf") and topic.publishers
    }
    return tuple(name for name in names if name and name != view.namespace)


def own_settings() -> dict[str, str]:
    """Return this environment's ROS variables and the middleware in use."""
    return {**ros_variables(os.environ), RMW: middleware()}
