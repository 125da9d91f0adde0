"""The state of a live tree, or of a recording: a small picture that verdicts are functions of."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from tfcompose.model.plan.topics import GLOBAL
from tfcompose.tf.live.arrivals import KEPT_NS

if TYPE_CHECKING:
    from collections.abc import Mapping

    from tfcompose.model.plan import Plan
    from tfcompose.tf.live.edges import EdgeState, Traffic
    from tfcompose.tf.live.publishers import Publisher
    from tfcompose.tf.live.sent_joints import SentJoints

#: How a publisher is called whose node has no name.
NAMELESS = "a publisher without a node name"
#: Who publishes with DDS and without ROS.
NO_NODE = "a DDS program that is no ROS node"


@dataclass(frozen=True, slots=True)
class TopicState:
    """A topic of the graph: its type, such as ``sensor_msgs/msg/LaserScan``, and nodes."""

    name: str
    type: str
    publishers: tuple[str, ...] = ()
    readers: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class StampedData:
    """Messages with a header on a topic, of one frame.

    ``delays_s`` are how old their stamps were when they came, in seconds of the clock that they
    are nearest to; negative: ahead of it. ``stamp_ns`` is the newest message's stamp, and
    ``received_ns`` when it came by the system's clock; None and 0 where that is not known.
    """

    topic: str
    frame: str
    nodes: tuple[str, ...]
    delays_s: tuple[float, ...]
    stamp_ns: int | None = None
    received_ns: int = 0


@dataclass(frozen=True, slots=True)
class MovingJoint:
    """A joint of the robot's description that moves.

    A listener to joint states has to publish its edge.
    """

    name: str
    parent: str
    child: str
    mimic: bool = False


@dataclass(frozen=True, slots=True)
class RosProcess:
    """A process on this machine that has ROS loaded, and the settings that it was started with."""

    pid: int
    command: str
    settings: Mapping[str, str]


@dataclass(frozen=True, slots=True)
class TreeState:
    """What was observed in ``seconds`` on the topics (moving, fixed).

    Attributes:
        edges: each edge of each publisher.
        publishers: who is on the two topics.
        volatile_readers: the nodes that listen to the topic of fixed edges without asking for what
            was sent before.
        nodes: the full names of other nodes, of this robot or not.
        graph: the topics, those of TF among them.
        clock_ns: the newest time on /clock, None where nothing came.
        clock_moves: whether that changed lately.
        stamped: what came with a header.
        moving_joints: the moving joints of the robot's description.
        sent_joints: who sent joint states, and of which joints.
        settings: the variables by which ROS is set up here.
        processes: other processes of this machine with ROS, as far as they can be looked at.
        skews_s: how far the clock of a publisher's machine is ahead of this one's, at least
            (negative: or its messages are that long under way), by id.
        malformed: how many messages came that are no TFMessage, by their publisher's id.
        beyond: how many transforms came of edges that are not among ``edges``, because their
            publisher sends too many, by its id.
        sent: what each publisher sent on the topic of moving edges, by its id.
        recorded: whether it is from a recording, which does not say who published.
    """

    seconds: float
    topics: tuple[str, str] = GLOBAL
    edges: tuple[EdgeState, ...] = ()
    publishers: tuple[Publisher, ...] = ()
    volatile_readers: tuple[str, ...] = ()
    nodes: tuple[str, ...] = ()
    graph: tuple[TopicState, ...] = ()
    clock_ns: int | None = None
    clock_moves: bool = False
    stamped: tuple[StampedData, ...] = ()
    moving_joints: tuple[MovingJoint, ...] = ()
    sent_joints: tuple[SentJoints, ...] = ()
    settings: Mapping[str, str] = field(default_factory=dict)
    processes: tuple[RosProcess, ...] = ()
    skews_s: Mapping[bytes, float] = field(default_factory=dict)
    malformed: Mapping[bytes | None, int] = field(default_factory=dict)
    beyond: Mapping[bytes | None, int] = field(default_factory=dict)
    plan: Plan | None = None
    sent: Mapping[bytes | None, Traffic] = field(default_factory=dict)
    recorded: bool = False

    @property
    def joint_names(self) -> frozenset[str]:
        """The joints that joint states speak of."""
        return frozenset(joint for sent in self.sent_joints for joint in sent.joints)

    @property
    def taken(self) -> list[EdgeState]:
        """The edges that tf2 takes, of each publisher."""
        return [edge for edge in self.edges if edge.stream.is_taken]

    @property
    def moving(self) -> list[EdgeState]:
        """Those of them that come on /tf."""
        return [edge for edge in self.taken if not edge.stream.static]

    @property
    def planned(self) -> frozenset[str]:
        """The frames whose owner a plan declares."""
        return frozenset(edge.child for edge in self.plan.edges) if self.plan else frozenset()

    @property
    def rated(self) -> frozenset[str]:
        """The frames whose rate a plan declares: they are judged by that."""
        return (
            frozenset(edge.child for edge in self.plan.edges if edge.rate)
            if self.plan
            else frozenset()
        )

    @property
    def simulated(self) -> bool:
        """Whether stamps should be of simulated time.

        A plan says so, or most edges are nearer to /clock.
        """
        if self.plan and self.plan.ros.clock == "sim":
            return True
        if self.clock_ns is None:
            return False
        stamps = [edge.stream.stamp_ns for edge in self.moving if edge.stream.stamp_ns]
        return 2 * sum(abs(stamp_ns - self.clock_ns) <= KEPT_NS for stamp_ns in stamps) >= len(
            stamps
        )

    def where(self, edge: EdgeState) -> str:
        """Return the machine and process of an edge's publisher, empty if unknown."""
        return next(
            (publisher.where for publisher in self.publishers if publisher.gid == edge.stream.gid),
            "",
        )

    def topics_of_type(self, type_: str) -> list[TopicState]:
        """Return the topics of that type."""
        return [topic for topic in self.graph if topic.type == type_]


def who(edge: EdgeState) -> str:
    """Return the publisher, as people read it."""
    return edge.publisher or NAMELESS
