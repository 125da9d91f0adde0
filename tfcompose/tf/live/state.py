"""State of a live tree or a recording, which verdicts judge."""

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

#: Name of a publisher whose node has no name.
NAMELESS = "a publisher without a node name"
#: Name of a publisher that uses DDS without ROS.
NO_NODE = "a DDS program that is not a ROS node"


@dataclass(frozen=True, slots=True)
class TopicState:
    """A topic of the graph, with its type, such as ``sensor_msgs/msg/LaserScan``, and nodes."""

    name: str
    type: str
    publishers: tuple[str, ...] = ()
    readers: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class StampedData:
    """Messages with a header on a topic, with the same frame."""

    topic: str
    frame: str
    nodes: tuple[str, ...]
    #: Ages of the stamps on arrival, in seconds by the nearest clock; negative if ahead of it.
    delays_s: tuple[float, ...]
    #: The newest message's stamp, None if unknown.
    stamp_ns: int | None = None
    #: The newest message's arrival by the system clock; 0 if unknown.
    received_ns: int = 0


@dataclass(frozen=True, slots=True)
class MovingJoint:
    """A moving joint of the robot description.

    A node that subscribes to joint states publishes it.
    """

    name: str
    parent: str
    child: str
    mimic: bool = False


@dataclass(frozen=True, slots=True)
class RosProcess:
    """A process on this machine that has ROS loaded, and its initial settings."""

    pid: int
    command: str
    settings: Mapping[str, str]


@dataclass(frozen=True, slots=True)
class TreeState:
    """Observations on a pair of TF topics."""

    #: Duration of the observation in seconds.
    seconds: float
    #: The topics (moving, fixed).
    topics: tuple[str, str] = GLOBAL
    #: Each edge of each publisher.
    edges: tuple[EdgeState, ...] = ()
    #: The publishers on the two topics.
    publishers: tuple[Publisher, ...] = ()
    #: Nodes that subscribe to fixed edges but do not request latched messages.
    volatile_readers: tuple[str, ...] = ()
    #: Full names of other nodes, of this robot or not.
    nodes: tuple[str, ...] = ()
    #: All topics, including those of TF.
    graph: tuple[TopicState, ...] = ()
    #: The newest time on /clock, None without one.
    clock_ns: int | None = None
    #: Whether that time has changed recently.
    clock_moves: bool = False
    #: Messages with a header.
    stamped: tuple[StampedData, ...] = ()
    #: The moving joints of the robot description.
    moving_joints: tuple[MovingJoint, ...] = ()
    #: The senders of joint states, with their joints.
    sent_joints: tuple[SentJoints, ...] = ()
    #: The environment variables of ROS in this process.
    settings: Mapping[str, str] = field(default_factory=dict)
    #: Other processes of this machine that have ROS loaded and can be inspected.
    processes: tuple[RosProcess, ...] = ()
    #: Minimum lead of the clock of a publisher's machine over this machine's clock, by the
    #: publisher's id. It is negative if that clock lags or messages take that long.
    skews_s: Mapping[bytes, float] = field(default_factory=dict)
    #: Number of messages that are not TFMessage, by publisher id.
    malformed: Mapping[bytes | None, int] = field(default_factory=dict)
    #: Number of transforms of edges that are not kept because their publisher sends too many, by
    #: the publisher's id.
    beyond: Mapping[bytes | None, int] = field(default_factory=dict)
    plan: Plan | None = None
    #: Traffic of each publisher on the topic of moving edges, by its id.
    sent: Mapping[bytes | None, Traffic] = field(default_factory=dict)
    #: Whether this is a recording, which does not identify publishers.
    recorded: bool = False

    @property
    def joint_names(self) -> frozenset[str]:
        """The joints named in joint states."""
        return frozenset(joint for sent in self.sent_joints for joint in sent.joints)

    @property
    def taken(self) -> list[EdgeState]:
        """The edges of all publishers that tf2 accepts."""
        return [edge for edge in self.edges if edge.stream.is_taken]

    @property
    def moving(self) -> list[EdgeState]:
        """The accepted edges on /tf."""
        return [edge for edge in self.taken if not edge.stream.static]

    @property
    def planned(self) -> frozenset[str]:
        """The frames whose owner is in a plan."""
        return frozenset(edge.child for edge in self.plan.edges) if self.plan else frozenset()

    @property
    def rated(self) -> frozenset[str]:
        """The frames whose rate a plan declares; that rate is their limit."""
        return (
            frozenset(edge.child for edge in self.plan.edges if edge.rate)
            if self.plan
            else frozenset()
        )

    @property
    def simulated(self) -> bool:
        """Whether stamps should have simulated time.

        That is so if the plan says so, or if most edges are nearer to /clock than to system time.
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
    """Return the publisher for display."""
    return edge.publisher or NAMELESS
