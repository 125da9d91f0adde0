"""Looks at the running system for a while, and returns its state: what the doctor judges."""

from __future__ import annotations

import os
import time
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from tfcompose.live.edges import SETTLE_S, TreeObserver
from tfcompose.live.listener import TreeListener
from tfcompose.live.sensors import SensorTopics
from tfcompose.live.state import RosProcess, Topic, TreeState
from tfcompose.plan.topics import GLOBAL
from tfcompose.ros.clock import wall_ns
from tfcompose.ros.environment import RMW
from tfcompose.ros.graph import ends, nodes, topics, volatile_readers
from tfcompose.ros.node import middleware, open_node
from tfcompose.ros.processes import ros_processes, settings_in

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rclpy.node import Node

    from tfcompose.live.topics import TFData
    from tfcompose.plan import Plan
    from tfcompose.ros.stop import Stop

    Topics = tuple[str, str]

WAIT_S = 0.05
ASK_EVERY_S = 0.5
#: A simulator or a player sends its time much more often.
CLOCK_STANDS_S = 2.0
#: Nodes of tools that look, as this one does, say nothing about the robot.
TOOLS = ("/tfcompose_", "/_ros2cli_")
#: What is looked at besides TF itself.
INTERESTING = ("tf2_msgs/msg/TFMessage", "rosgraph_msgs/msg/Clock", "sensor_msgs/msg/JointState")


def observe(expected: Mapping[Topics, Plan | None], seconds: float, stop: Stop) -> list[TreeState]:
    """Observe the topics (moving, fixed) for so many seconds, or until ``stop`` is requested.

    Each pair of topics may have a plan that says what is expected on it; there is a state for each pair.

    Raises:
        RosError: if ROS cannot start a node, or take messages.
    """
    with open_node("tfcompose_doctor", "") as node:
        views = [_View(node, pair) for pair in expected]
        graph: dict[str, Topic] = {}
        due = begun = time.monotonic()  # a slow machine may take seconds until it listens
        while not stop.requested and (now := time.monotonic()) < begun + seconds:
            for view in views:
                view.listen(min(WAIT_S, begun + seconds - now), stop)
            if now >= due:
                due = now + ASK_EVERY_S
                graph |= topics_in(node)
                for view in views:
                    view.sensors.subscribe(graph.values(), _robots_inside(view, graph))
        for view in views:
            view.listen(0.0, stop)  # what came while this process was kept from looking
        graph |= topics_in(node)  # the last word counts, but what was seen before is not forgotten
        common = TreeState(
            time.monotonic() - begun,
            nodes=tuple(name for name in nodes(node) if not name.startswith(TOOLS)),
            graph=tuple(graph.values()),
            settings=own_settings(),
            processes=tuple(RosProcess(*one) for one in ros_processes()),
        )
        return [replace(view.state(common), plan=plan) for view, plan in zip(views, expected.values(), strict=True)]


@dataclass(slots=True)
class _View:
    """What is seen on one pair of topics, and below its namespace."""

    node: Node
    topics: Topics
    observer: TreeObserver = field(default_factory=lambda: TreeObserver(0.0, SETTLE_S))
    skews_s: dict[bytes, float] = field(default_factory=dict)
    clock: tuple[int | None, float] = (None, 0.0)  # the newest, and when it moved, of the monotonic clock; 0: not yet
    listener: TreeListener = field(init=False)
    sensors: SensorTopics = field(init=False)

    def __post_init__(self) -> None:
        self.listener = TreeListener(self.node, self.observer, self.topics)
        self.sensors = SensorTopics(self.node, self.namespace)

    @property
    def namespace(self) -> str:
        return self.topics[0].removesuffix("/tf")

    def listen(self, timeout_s: float, stop: Stop) -> None:
        for data in self.listener.listen(timeout_s, stop):
            self._compare_clocks(data)
        clock_ns = self.listener.clock_ns
        if clock_ns != self.clock[0]:
            self.clock = (clock_ns, 0.0 if self.clock[0] is None else time.monotonic())
        self.sensors.take(clock_ns)

    def _compare_clocks(self, data: TFData) -> None:
        """Note by how much the sender's clock is ahead at least: a latched message may be old."""
        received = data.received
        if received.gid is None or data.static or not received.source_ns:
            return
        ahead_s = (received.source_ns - (received.received_ns or wall_ns())) / 1e9
        self.skews_s[received.gid] = max(ahead_s, self.skews_s.get(received.gid, ahead_s))

    def state(self, common: TreeState) -> TreeState:
        return replace(
            common,
            topics=self.topics,
            edges=tuple(self.observer.edges(wall_ns())),
            publishers=tuple(self.listener.graph.publishers()),
            volatile_readers=tuple(
                name for name in volatile_readers(self.node, self.topics[1]) if not name.startswith(TOOLS)
            ),
            malformed=dict(self.observer.malformed),
            clock_ns=self.listener.clock_ns,
            clock_moves=self.clock[1] > time.monotonic() - CLOCK_STANDS_S,
            skews_s=self.skews_s,
            stamped=self.sensors.stamped(),
            moving_joints=self.sensors.moving_joints,
            joint_names=frozenset(self.sensors.joint_names),
        )


def topics_in(node: Node) -> dict[str, Topic]:
    """Return the topics that say something about TF, with the nodes at their ends, by name and type."""
    found = {}
    for name, types in topics(node):
        if name not in GLOBAL and not set(types) & {*INTERESTING, *SensorTopics.TYPES}:
            continue
        both = [end for end in ends(node, name) if not end[0].startswith(TOOLS)]
        for kind in types:
            senders = tuple(dict.fromkeys(who for who, type_, sends in both if sends and type_ == kind))
            readers = tuple(dict.fromkeys(who for who, type_, sends in both if not sends and type_ == kind))
            if senders or readers:
                found[f"{name} {kind}"] = Topic(name, kind, senders, readers)
    return found


def _robots_inside(view: _View, graph: dict[str, Topic]) -> tuple[str, ...]:
    """Return the namespaces, below this one, of robots that have TF topics of their own."""
    names = {
        topic.name.removesuffix("/tf") for topic in graph.values() if topic.name.endswith("/tf") and topic.publishers
    }
    return tuple(name for name in names if name and name != view.namespace)


def own_settings() -> dict[str, str]:
    """Return ROS's variables in this process's environment, and the middleware that it uses, set or not."""
    own = settings_in(b"\0".join(f"{name}={value}".encode() for name, value in os.environ.items()))
    return {**own, RMW: middleware()}
