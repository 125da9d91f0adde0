"""Looks at the running system for a while, and says what is wrong with it."""

from __future__ import annotations

import os
import time
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from tfcompose.observe.census import SETTLE_S, Census
from tfcompose.observe.diagnose import diagnose
from tfcompose.observe.diagnose.tree import trees_of
from tfcompose.observe.elsewhere import tf_elsewhere
from tfcompose.observe.live import Live
from tfcompose.observe.seen import RosProcess, Seen, Topic
from tfcompose.observe.sideline import Sideline
from tfcompose.plan.topics import GLOBAL
from tfcompose.ros.clock import wall_ns
from tfcompose.ros.environment import RMW
from tfcompose.ros.graph import ends, nodes, topics, volatile_readers
from tfcompose.ros.node import middleware, open_node
from tfcompose.ros.processes import ros_processes, settings_in

if TYPE_CHECKING:
    from rclpy.node import Node

    from tfcompose.findings import Finding
    from tfcompose.observe.live import Heard
    from tfcompose.plan import Plan
    from tfcompose.ros.stop import Stop

    Topics = tuple[str, str]

WAIT_S = 0.05
LOOK_EVERY_S = 0.5
#: A simulator or a player sends its time much more often.
CLOCK_STANDS_S = 2.0
#: Nodes of tools that look, as this one does, say nothing about the robot.
TOOLS = ("/tfcompose_", "/_ros2cli_")
#: What is looked at besides TF itself.
INTERESTING = ("tf2_msgs/msg/TFMessage", "rosgraph_msgs/msg/Clock", "sensor_msgs/msg/JointState")


@dataclass(frozen=True, slots=True)
class Found:
    """What was found, and what was looked at: edges, publishing nodes, seconds, the trees' roots.

    ``elsewhere`` are topics with TF that were not looked at.
    """

    findings: list[Finding]
    edges: int
    nodes: int
    seconds: float
    roots: tuple[str, ...] = ()
    elsewhere: tuple[str, ...] = ()


def examine(expected: dict[Topics, Plan | None], seconds: float, stop: Stop) -> Found:
    """Look at the topics (moving, fixed) for so many seconds, or until ``stop`` is requested, and judge.

    Each pair of topics may have a plan that says what is expected on it.

    Raises:
        RosError: if ROS cannot start a node, or take messages.
    """
    with open_node("tfcompose_doctor", "") as node:
        ears = [_Ear(node, pair) for pair in expected]
        graph: dict[str, Topic] = {}
        due = begun = time.monotonic()  # a slow machine may take seconds until it listens
        while not stop.requested and (now := time.monotonic()) < begun + seconds:
            for ear in ears:
                ear.hear(min(WAIT_S, begun + seconds - now), stop)
            if now >= due:
                due = now + LOOK_EVERY_S
                graph |= graph_of(node)
                for ear in ears:
                    ear.sideline.look(graph.values(), _beside(ear, graph))
        for ear in ears:
            ear.hear(0.0, stop)  # what came while this process was kept from looking
        graph |= graph_of(node)  # the last word counts, but what was seen before is not forgotten
        looked = time.monotonic() - begun
        common = Seen(
            looked,
            nodes=tuple(name for name in nodes(node) if not name.startswith(TOOLS)),
            graph=tuple(graph.values()),
            settings=own_settings(),
            processes=tuple(RosProcess(*one) for one in ros_processes()),
        )
        pictures = [replace(ear.picture(common), plan=plan) for ear, plan in zip(ears, expected.values(), strict=True)]
    return _judged(pictures, looked)


def _judged(pictures: list[Seen], seconds: float) -> Found:
    findings = list(dict.fromkeys(one for seen in pictures for one in diagnose(seen)))
    edges = {(edge.strand.parent, edge.strand.child) for seen in pictures for edge in seen.taken}
    names = {name for seen in pictures for edge in seen.taken for name in edge.nodes}
    roots = tuple(dict.fromkeys(root for seen in pictures for root in trees_of(seen)))
    own = {topic for seen in pictures for topic in seen.topics}
    graph = [(topic.name, (topic.type,)) for topic in pictures[0].graph if topic.publishers] if pictures else []
    return Found(
        sorted(findings, key=lambda one: one.severity), len(edges), len(names), seconds, roots,
        tf_elsewhere(graph, own),
    )  # fmt: skip


@dataclass(slots=True)
class _Ear:
    """What is heard on one pair of topics."""

    node: Node
    topics: Topics
    census: Census = field(default_factory=lambda: Census(0.0, SETTLE_S))
    skews_s: dict[bytes, float] = field(default_factory=dict)
    clock: tuple[int | None, float] = (None, 0.0)  # the newest, and when it moved, of the monotonic clock; 0: not yet
    live: Live = field(init=False)
    sideline: Sideline = field(init=False)

    def __post_init__(self) -> None:
        self.live = Live(self.node, self.census, self.topics)
        self.sideline = Sideline(self.node, self.topics[0].removesuffix("/tf"))

    def hear(self, timeout_s: float, stop: Stop) -> None:
        for heard in self.live.look(timeout_s, stop):
            self._compare_clocks(heard)
        clock_ns = self.live.clock_ns
        if clock_ns != self.clock[0]:
            self.clock = (clock_ns, 0.0 if self.clock[0] is None else time.monotonic())
        self.sideline.take(clock_ns)

    def _compare_clocks(self, heard: Heard) -> None:
        """Note by how much the sender's clock is ahead at least: a latched message may be old."""
        if heard.gid is None or heard.static or not heard.sent_ns:
            return
        ahead_s = (heard.sent_ns - heard.received_ns) / 1e9
        self.skews_s[heard.gid] = max(ahead_s, self.skews_s.get(heard.gid, ahead_s))

    def picture(self, common: Seen) -> Seen:
        return replace(
            common,
            topics=self.topics,
            edges=tuple(self.census.edges(wall_ns())),
            publishers=tuple(self.live.publishers()),
            forgetful=tuple(name for name in volatile_readers(self.node, self.topics[1]) if not name.startswith(TOOLS)),
            malformed=dict(self.census.malformed),
            clock_ns=self.live.clock_ns,
            clock_moves=self.clock[1] > time.monotonic() - CLOCK_STANDS_S,
            skews_s=self.skews_s,
            **self.sideline.picture(),
        )


def graph_of(node: Node) -> dict[str, Topic]:
    """Return the topics that say something about TF, with the nodes at their ends, by name."""
    found = {}
    for name, types in topics(node):
        if name not in GLOBAL and not set(types) & {*INTERESTING, *Sideline.TYPES}:
            continue
        both = [end for end in ends(node, name) if not end[0].startswith(TOOLS)]
        for kind in types:
            senders = tuple(dict.fromkeys(who for who, type_, sends in both if sends and type_ == kind))
            readers = tuple(dict.fromkeys(who for who, type_, sends in both if not sends and type_ == kind))
            if senders or readers:
                found[f"{name} {kind}"] = Topic(name, kind, senders, readers)
    return found


def _beside(ear: _Ear, graph: dict[str, Topic]) -> tuple[str, ...]:
    """Return the namespaces, below this one, of robots that have TF topics of their own."""
    names = {
        topic.name.removesuffix("/tf") for topic in graph.values() if topic.name.endswith("/tf") and topic.publishers
    }
    return tuple(name for name in names if name and name != ear.topics[0].removesuffix("/tf"))


def own_settings() -> dict[str, str]:
    """Return ROS's variables in this process's environment, and the middleware that it uses, set or not."""
    own = settings_in(b"\0".join(f"{name}={value}".encode() for name, value in os.environ.items()))
    return {**own, RMW: middleware()}
