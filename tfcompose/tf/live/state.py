"""State of a live tree or of a recording, as the input of verdicts."""

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
    """A topic of the graph: its type, such as ``sensor_msgs/msg/LaserScan``, and nodes."""

    name: str
    type: str
    publishers: tuple[str, ...] = ()
    readers: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class StampedData:
    """Messages with a header on a topic, of one frame."""

    topic: str
    frame: str
    nodes: tuple[str, ...]
    #: Ages of the stamps at their arrival, in seconds of the nearest clock; negative: ahead of it.
    delays_s: tuple[float, ...]
    #: The newest message's stamp; None: unknown.
    stamp_ns: int | None = None
    #: The newest message's arrival by the system clock; 0: unknown.
    received_ns: int = 0


@dataclass(frozen=True, slots=True)
class MovingJoint:
    """A moving joint of the robot description; a subscriber to joint states publishes its edge."""

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

    #: Duration of the observation.
    seconds: float
    #: The topics (moving, fixed).
    topics: tuple[str, str] = GLOBAL
    #: Each edge of each publisher.
    edges: tuple[EdgeState, ...] = ()
    #: The publishers on the two topics.
    publishers: tuple[Publisher, ...] = ()
    #: Nodes that subscribe to fixed edges without requesting latched messages.
    volatile_readers: tuple[str, ...] = ()
    #: Full names of other nodes, of this robot or not.
    nodes: tuple[str, ...] = ()
    #: All topics, including those of TF.
    graph: tuple[TopicState, ...] = ()
    #: The newest time on /clock; None: none came.
    clock_ns: int | None = None
    #: True: that time changed recently.
    clock_moves: bool = False
    #: Messages with a header.
    stamped: tuple[StampedData, ...] = ()
    #: The moving joints of the robot description.
    moving_joints: tuple[MovingJoint, ...] = ()
    #: The senders of joint states, with their joints.
    sent_joints: tuple[SentJoints, ...] = ()
    #: The environment variables that set up ROS here.
    settings: Mapping[str, str] = field(default_factory=dict)
    #: Other processes of this machine with ROS, as far as they can be inspected.
    processes: tuple[RosProcess, ...] = ()
    #: Minimum lead of the clock of a publisher's machine over this one's, by id; negative: it
    #: lags, or messages take that long.
    skews_s: Mapping[bytes, float] = field(default_factory=dict)
    #: Number of messages that are not TFMessage, by publisher id.
    malformed: Mapping[bytes | None, int] = field(default_factory=dict)
    #: Number of transforms of edges that are not kept, because their publisher sends too many, by
    #: its id.
    beyond: Mapping[bytes | None, int] = field(default_factory=dict)
    plan: Plan | None = None
    #: Traffic of each publisher on the topic of moving edges, by its id.
    sent: Mapping[bytes | None, Traffic] = field(default_factory=dict)
    #: True: a recording, which does not identify publishers.
    recorded: bool = False

    @property
    def joint_names(self) -> frozenset[str]:
        """The joints named in joint states."""
        return frozenset(joint for sent in self.sent_joints for joint in sent.joints)

    @property
    def taken(self) -> list[EdgeState]:
        """The edges that tf2 accepts, of each publisher."""
        return [edge for edge in self.edges if edge.stream.is_taken]

    @property
    def moving(self) -> list[EdgeState]:
        """The accepted edges that come on /tf."""
        return [edge for edge in self.taken if not edge.stream.static]

    @property
    def planned(self) -> frozenset[str]:
        """The frames whose owner a plan declares."""
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
        """Whether stamps should be of simulated time.

        The plan says so, or most edges are nearer to /clock.
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
