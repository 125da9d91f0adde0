"""What the doctor knows of a running system: a small picture that its diagnoses are functions of."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from tfcompose.plan.topics import GLOBAL
from tfcompose.verdict.clock import WRONG_BY_NS

if TYPE_CHECKING:
    from collections.abc import Mapping

    from tfcompose.observe.census import EdgeSeen, Publisher
    from tfcompose.plan import Plan

NAMELESS = "a publisher without a node name"
#: Of a list of names so many are shown.
LISTED = 6


@dataclass(frozen=True, slots=True)
class Topic:
    """A topic of the graph: its type, such as ``sensor_msgs/msg/LaserScan``, and the nodes at both ends."""

    name: str
    type: str
    publishers: tuple[str, ...] = ()
    readers: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Stamped:
    """Messages with a header on a topic, of one frame.

    ``delays_s`` are how old their stamps were when they came, in seconds of the clock that they are nearest to;
    negative: ahead of it. ``stamp_ns`` is the newest message's stamp, and ``received_ns`` when it came by the system's
    clock; None and 0 where that is not known.
    """

    topic: str
    frame: str
    nodes: tuple[str, ...]
    delays_s: tuple[float, ...]
    stamp_ns: int | None = None
    received_ns: int = 0


@dataclass(frozen=True, slots=True)
class Movable:
    """A joint of the robot's description that moves: a listener to joint states has to publish its edge."""

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
class Seen:
    """What was seen in ``seconds``, of the topics (moving, fixed).

    Attributes:
        edges: each edge of each publisher.
        publishers: who is on the two topics.
        forgetful: the nodes that listen to the topic of fixed edges, and do not ask for what was sent before they came.
        nodes: the full names of other nodes, of this robot or not.
        graph: the topics, those of TF among them.
        clock_ns: the newest time on /clock, None where nothing came.
        clock_moves: whether that changed lately.
        stamped: what came with a header.
        movable: its moving joints.
        joint_names: those in joint states.
        settings: the variables by which ROS is set up here.
        processes: other processes of this machine with ROS, as far as they can be looked at.
        skews_s: how far the clock of a publisher's machine is ahead of this one's, at least (negative: or its
            messages are that long under way), by id.
        malformed: how many messages came that are no TFMessage, by their publisher's id.
        recorded: whether it is from a recording, which does not say who published.
    """

    seconds: float
    topics: tuple[str, str] = GLOBAL
    edges: tuple[EdgeSeen, ...] = ()
    publishers: tuple[Publisher, ...] = ()
    forgetful: tuple[str, ...] = ()
    nodes: tuple[str, ...] = ()
    graph: tuple[Topic, ...] = ()
    clock_ns: int | None = None
    clock_moves: bool = False
    stamped: tuple[Stamped, ...] = ()
    movable: tuple[Movable, ...] = ()
    joint_names: frozenset[str] = frozenset()
    settings: Mapping[str, str] = field(default_factory=dict)
    processes: tuple[RosProcess, ...] = ()
    skews_s: Mapping[bytes, float] = field(default_factory=dict)
    malformed: Mapping[bytes | None, int] = field(default_factory=dict)
    plan: Plan | None = None
    recorded: bool = False

    @property
    def taken(self) -> list[EdgeSeen]:
        """The edges that tf2 takes."""
        return [edge for edge in self.edges if edge.strand.refusals < edge.strand.tally.count]

    @property
    def moving(self) -> list[EdgeSeen]:
        """Those of them that come on /tf."""
        return [edge for edge in self.taken if not edge.strand.static]

    @property
    def planned(self) -> frozenset[str]:
        """The frames of which a plan says who publishes them."""
        return frozenset(edge.child for edge in self.plan.edges) if self.plan else frozenset()

    @property
    def rated(self) -> frozenset[str]:
        """The frames of which a plan says how often they come: they are judged by that."""
        return frozenset(edge.child for edge in self.plan.edges if edge.rate) if self.plan else frozenset()

    @property
    def simulated(self) -> bool:
        """Whether stamps should be of simulated time: a plan says so, or most edges are nearer to /clock."""
        if self.plan and self.plan.ros.clock == "sim":
            return True
        if self.clock_ns is None:
            return False
        stamps = [edge.strand.stamp_ns for edge in self.moving if edge.strand.stamp_ns]
        return 2 * sum(abs(stamp_ns - self.clock_ns) <= WRONG_BY_NS for stamp_ns in stamps) >= len(stamps)

    def where(self, edge: EdgeSeen) -> str:
        """Return on which machine and as which process the publisher of an edge runs, empty if that is not known."""
        return next((one.where for one in self.publishers if one.gid == edge.strand.gid), "")

    def typed(self, type_: str) -> list[Topic]:
        """Return the topics of that type."""
        return [topic for topic in self.graph if topic.type == type_]


def who(edge: EdgeSeen) -> str:
    """Return the publisher, as people read it."""
    return edge.publisher or NAMELESS


def counted(number: int, word: str) -> str:
    """Return the number with the word, in the plural where it belongs."""
    return f"{number} {word}{'' if number == 1 else 's'}"


def listed(names: object) -> str:
    """Return names with commas, the first of many only."""
    some = [str(name) for name in names] if isinstance(names, (list, tuple, set, frozenset, dict)) else [str(names)]
    more = f" and {len(some) - LISTED} more" if len(some) > LISTED else ""
    return ", ".join(some[:LISTED]) + more
