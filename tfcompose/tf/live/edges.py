"""Observation of edges for monitor, verify, view and doctor.

An observer records the publisher, rate and delay of each edge. It takes messages from a
subscription or a bag, and the endpoints of the ROS graph. It reads no clock and no topic itself.
Its memory does not grow with time, and is bounded even if a publisher keeps inventing frame names.
Times are in nanoseconds.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import isfinite
from typing import TYPE_CHECKING

from tfcompose.foundation.geometry import Pose, norm
from tfcompose.foundation.tree import below, children_of, draw_tree, loops, trees
from tfcompose.tf.live.arrivals import Arrivals, Timing
from tfcompose.tf.live.flood import MOST_EDGES, MOST_OF_ONE
from tfcompose.tf.live.publishers import Publisher, Publishers
from tfcompose.tf.tf2.exceptions import DENORMALISED, Rejection, rejection_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from tfcompose.model.plan import PlanEdge
    from tfcompose.tf.live.sent_joints import SentJoints
    from tfcompose.tf.ros.tf_codec import Row


#: Arrivals within this time in seconds after the first arrival are not counted, because a new
#: subscriber receives all latched messages at once.
SETTLE_S = 0.3
#: A frame changes its parent on purpose if it keeps each parent for at least this many transforms
#: on average.
MIN_RUN = 3
#: A quaternion with a smaller length is not a rotation.
LEAST_LENGTH = 1e-9
_SECOND_NS = 1_000_000_000


def nearer_clock(
    rows: Sequence[Row], received_ns: int, clock_ns: int | None, *, static: bool
) -> int | None:
    """Return the time of /clock if stamps are nearer to it than to ``received_ns``, or None."""
    if clock_ns is None or static or not rows:
        return None
    stamp_ns = rows[0][2] * _SECOND_NS + rows[0][3]
    return clock_ns if abs(stamp_ns - clock_ns) < abs(stamp_ns - received_ns) else None


@dataclass(slots=True)
class EdgeStream:
    """An edge from a publisher on a kind of topic (moving or fixed).

    Frame names are as in tf2, without a leading slash.
    """

    #: The reference frame of the pose.
    parent: str
    #: The frame with this pose.
    child: str
    #: Whether it was received on /tf_static.
    static: bool
    #: The publisher's id, 16 bytes, None if unknown, as in a bag.
    gid: bytes | None
    #: Arrivals: ``arrivals.count`` messages, the newest at ``arrivals.last_ns``.
    arrivals: Arrivals
    #: Arrival of the first message, by the receiver's clock.
    first_ns: int
    #: The newest transform.
    row: Row
    #: The largest stamp so far.
    newest_ns: int = -1
    #: The stamp of the newest message.
    stamp_ns: int = -1
    #: The stamp of the first message.
    oldest_ns: int = -1
    #: Arrival of the newest message minus its stamp, negative if the stamp is ahead of the
    #: receiver's clock.
    delay_ns: int = 0
    #: Number of stamps that are earlier than the previous stamp.
    stamps_back: int = 0
    #: Number of stamps that are equal to the previous stamp.
    stamps_repeated: int = 0
    #: The reason of tf2's last rejection.
    rejected: Rejection | None = None
    #: The last transform that tf2 rejects.
    rejected_row: Row | None = None
    #: Number of transforms that tf2 rejects.
    rejections: int = 0
    #: Whether a name had a leading slash.
    slashed: bool = False
    #: The edges, including this edge, with which the publisher gives this frame different parents;
    #: None if this is its only parent.
    handover: Handover | None = None
    #: Number of times that this edge followed another edge of ``handover``.
    begun: int = 0

    @property
    def is_taken(self) -> bool:
        """Whether tf2 accepts any of its transforms.

        tf2 on Jazzy converts a quaternion to a matrix before it checks the length, which
        normalises it. A quaternion of length 0 stays invalid.
        """
        if self.rejections < self.arrivals.count:
            return True
        is_rotation = norm(self.row[7:11]) > LEAST_LENGTH
        return self.rejected is Rejection.DENORMALISED and is_rotation

    @property
    def pose(self) -> Pose:
        """The newest pose of the child in the parent, as sent, without normalisation."""
        return Pose(self.row[4:7], self.row[7:11])

    @property
    def speed(self) -> float:
        """Advance of its stamps in seconds per second; 1 if unknown."""
        took_ns, stamped_ns = (
            self.arrivals.last_ns - self.first_ns,
            self.newest_ns - self.oldest_ns,
        )
        return stamped_ns / took_ns if took_ns > 0 and stamped_ns > 0 else 1.0

    def take(self, row: Row, received_ns: int, clock_ns: int) -> None:
        """Add a transform. Its stamp is compared with ``clock_ns``."""
        stamp_ns = row[2] * _SECOND_NS + row[3]
        self.row = row
        if stamp_ns > self.newest_ns:
            if self.newest_ns < 0:
                self.oldest_ns = stamp_ns
            self.newest_ns = stamp_ns
        elif stamp_ns < self.stamp_ns:
            self.stamps_back += 1
        elif stamp_ns == self.stamp_ns:
            self.stamps_repeated += 1
        self.stamp_ns = stamp_ns
        self.delay_ns = clock_ns - stamp_ns
        if self.handover is not None and self.handover.take(self) and self.handover.is_one:
            self.arrivals.note_resumption(received_ns)
        else:
            self.arrivals.note_arrival(received_ns, None if self.static else self.delay_ns)
        _, _, _, _, px, py, pz, x, y, z, w = row
        is_unit = abs(x * x + y * y + z * z + w * w - 1) < DENORMALISED
        if (
            not (is_unit and isfinite(px + py + pz))
            or self.parent == self.child
            or not self.parent
            or not self.child
        ):
            self._reject()

    def _reject(self) -> None:
        """Count the newest transform as rejected if tf2 would reject it."""
        why = rejection_of(self.parent, self.child, self.row[4:])
        if why is not None:
            self.rejected, self.rejected_row, self.rejections = why, self.row, self.rejections + 1


@dataclass(slots=True)
class Handover:
    """The edges with which a publisher gives a frame alternating parents."""

    streams: list[EdgeStream]
    #: The edge of the last transform.
    holder: EdgeStream

    def join(self, stream: EdgeStream) -> None:
        """Add an edge."""
        self.streams.append(stream)
        if len(self.streams) > 1:
            for each in self.streams:
                each.handover = self

    def take(self, stream: EdgeStream) -> bool:
        """Add a transform; return whether the previous transform belonged to another edge."""
        if stream is self.holder:
            return False
        self.holder = stream
        stream.begun += 1
        return True

    @property
    def is_one(self) -> bool:
        """Whether the frame changes parents from time to time.

        If the parents alternate all the time, the frame jumps instead.
        """
        return all((each.begun - 1) * MIN_RUN <= each.arrivals.count for each in self.streams)


@dataclass(slots=True)
class Traffic:
    """Messages of a publisher on the topic of moving edges, and transforms in them."""

    messages: int = 0
    transforms: int = 0


@dataclass(frozen=True, slots=True)
class EdgeState:
    """The state of an edge from a publisher at a given time."""

    stream: EdgeStream
    #: Candidates for the publisher: a single node if certain, empty if no publisher has a name.
    nodes: tuple[str, ...]
    timing: Timing
    #: Time since the newest message arrived.
    age_s: float
    #: Time since the newest stamp; None for fixed edges.
    data_age_s: float | None
    #: Whether the publisher is in the graph, None without a graph.
    present: bool | None = None

    @property
    def parent(self) -> str:
        """The frame in which the pose is given."""
        return self.stream.parent

    @property
    def child(self) -> str:
        """The frame whose pose it is."""
        return self.stream.child

    @property
    def known_s(self) -> float:
        """Time since the first message arrived."""
        return self.age_s + (self.stream.arrivals.last_ns - self.stream.first_ns) * 1e-9

    @property
    def name(self) -> str:
        """The edge for display."""
        return f"{self.parent} → {self.child}"

    @property
    def publisher(self) -> str:
        """The publisher for display, empty if unknown."""
        return (
            self.nodes[0]
            if len(self.nodes) == 1
            else f"one of {', '.join(self.nodes)}"
            if self.nodes
            else ""
        )


@dataclass(slots=True)
class TreeObserver:
    """Observations of a TF tree."""

    #: Window for rates, jitter, gaps and delays in seconds (one to two windows); 0 for all time.
    window_s: float = 0.0
    #: Initial time of each edge that these ignore, in seconds.
    settle_s: float = 0.0
    messages: int = 0
    sent: dict[bytes | None, Traffic] = field(default_factory=dict)
    begun_ns: int = 0
    last_ns: int = 0
    #: End of a recording on any topic; 0 for a running tree.
    end_ns: int = 0
    #: Time when messages of a running tree were last read.
    observed_ns: int = 0
    #: Transforms of edges beyond the bounds, which are not kept, by publisher id.
    beyond: dict[bytes | None, int] = field(default_factory=dict)
    malformed: dict[bytes | None, int] = field(default_factory=dict)
    publishers: Publishers = field(default_factory=Publishers)
    #: Names of all nodes in the graph.
    nodes: tuple[str, ...] = ()
    #: Senders of joint states, if these are observed.
    sent_joints: tuple[SentJoints, ...] = ()
    _streams: dict[tuple[str, str, bytes | None, bool], EdgeStream] = field(default_factory=dict)
    _counts: dict[bytes, int] = field(default_factory=dict)
    _handovers: dict[tuple[str, bytes], Handover] = field(default_factory=dict)

    def take(
        self,
        rows: Iterable[Row],
        *,
        static: bool,
        gid: bytes | None,
        received_ns: int,
        clock_ns: int | None = None,
    ) -> None:
        """Process a message.

        Args:
            rows: the transforms of the message.
            static: whether it arrived on /tf_static.
            gid: the publisher's id, None if unknown.
            received_ns: the arrival.
            clock_ns: the time to compare stamps with, by default ``received_ns``.
        """
        self.begun_ns = self.begun_ns or received_ns
        self.messages += 1
        self.last_ns = received_ns
        traffic = None if static else self._traffic_of(gid)
        if traffic:
            traffic.messages += 1
        clock = received_ns if clock_ns is None else clock_ns
        streams = self._streams
        is_full = gid is not None and self._counts.get(gid, 0) >= MOST_OF_ONE
        for row in rows:
            if traffic:
                traffic.transforms += 1
            stream = streams.get((row[0], row[1], gid, static))
            if stream is None:
                stream = self._new(
                    row, static=static, gid=gid, received_ns=received_ns, is_full=is_full
                )
                if stream is None:
                    self.beyond[gid] = self.beyond.get(gid, 0) + 1
                    continue
            stream.take(row, received_ns, clock)

    def _traffic_of(self, gid: bytes | None) -> Traffic | None:
        if gid not in self.sent and len(self.sent) < MOST_EDGES:
            self.sent[gid] = Traffic()
        return self.sent.get(gid)

    def floods(self, gid: bytes | None) -> bool:
        """Return whether the publisher has sent more edges than are kept."""
        return gid in self.beyond

    def _new(
        self, row: Row, *, static: bool, gid: bytes | None, received_ns: int, is_full: bool
    ) -> EdgeStream | None:
        """Return the stream of an edge that is new or has a leading slash.

        None if there are too many edges.
        """
        parent, child = row[0].removeprefix("/"), row[1].removeprefix("/")
        stream = self._streams.get((parent, child, gid, static))
        if stream is None:
            if is_full or len(self._streams) >= MOST_EDGES:
                return None
            if gid is not None:
                self._counts[gid] = self._counts.get(gid, 0) + 1
            arrivals = Arrivals(int(self.window_s * _SECOND_NS), int(self.settle_s * _SECOND_NS))
            stream = EdgeStream(
                parent, child, static, gid=gid, arrivals=arrivals, first_ns=received_ns, row=row
            )
            self._streams[parent, child, gid, static] = stream
            if gid is not None and not static:
                self._handovers.setdefault((child, gid), Handover([], stream)).join(stream)
        if (parent, child) != row[:2]:
            stream.slashed = True
        return stream

    def take_malformed(self, gid: bytes | None) -> None:
        """Count a message that cannot be decoded as TFMessage."""
        if gid in self.malformed or len(self.malformed) < MOST_EDGES:
            self.malformed[gid] = self.malformed.get(gid, 0) + 1

    def take_graph(self, publishers: Sequence[Publisher], nodes: Sequence[str] = ()) -> None:
        """Update the current publishers and the names of the graph's nodes.

        Knowledge about publishers that have left is kept.
        """
        self.nodes = tuple(nodes)
        self.publishers.update(publishers)

    @property
    def until_ns(self) -> int:
        """The time up to which the observation extends: end of the recording, or the last read.

        So a late read does not make publishers seem silent.
        """
        return self.end_ns or self.observed_ns or self.last_ns

    @property
    def received_any(self) -> bool:
        """Whether any message arrived, readable or not."""
        return bool(self.messages or self.malformed)

    @property
    def recorded(self) -> bool:
        """Whether there is no graph to query, as with a recording."""
        return not self.publishers.queried

    @property
    def streams(self) -> tuple[EdgeStream, ...]:
        """The edges of all publishers, in the order of their first arrivals."""
        return tuple(self._streams.values())

    def edges(self, now_ns: int) -> list[EdgeState]:
        """Return the state of each edge at the receiver's ``now_ns``, by parent and child."""
        streams = sorted(self._streams.values(), key=_order)
        return [self._state(stream, now_ns) for stream in streams]

    def _state(self, stream: EdgeStream, now_ns: int) -> EdgeState:
        timing = stream.arrivals.timing(now_ns)
        age_s = max(0, now_ns - stream.arrivals.last_ns) * 1e-9
        # The age refers to the clock with which the stamps were compared, because the last delay
        # belongs to the last arrival.
        data_age_s = None if stream.static else age_s + stream.delay_ns * 1e-9
        present = (
            None if self.recorded or stream.gid is None else stream.gid in self.publishers.present
        )
        return EdgeState(
            stream,
            self._publisher_nodes(stream),
            timing,
            age_s=age_s,
            data_age_s=data_age_s,
            present=present,
        )

    def _publisher_nodes(self, stream: EdgeStream) -> tuple[str, ...]:
        """Return the publisher's node.

        Without an id, return all nodes on the topic. If these have left, return all former nodes.
        """
        nodes = self.publishers.nodes(stream.gid, static=stream.static)
        if nodes or stream.gid is not None:
            return nodes
        left = self.publishers.by_gid.values()
        return tuple(
            sorted(
                {
                    publisher.node
                    for publisher in left
                    if publisher.static == stream.static and publisher.node is not None
                }
            )
        )


def _order(stream: EdgeStream) -> tuple[str, str, bool, int]:
    return stream.parent, stream.child, not stream.static, stream.first_ns


@dataclass(frozen=True, slots=True)
class Branch:
    """A frame in a drawn tree."""

    frame: str
    #: The parent, None for a root.
    parent: str | None
    #: The lines that lead to it.
    indent: str
    #: Its edges from all publishers; the edge that tf2 uses comes first.
    observed: tuple[EdgeState, ...] = ()
    #: The edge in the plan.
    planned: PlanEdge | None = None


@dataclass(frozen=True, slots=True)
class Tree:
    """A root and all frames below it in drawing order, or a loop.

    A loop ends with its first frame.
    """

    branches: tuple[Branch, ...]
    loop: tuple[str, ...] = ()


def forest(
    edges: Iterable[EdgeState], planned: Mapping[str, PlanEdge] | None = None
) -> list[Tree]:
    """Return the trees, the largest first, then the loops.

    Planned edges without messages are included. A frame with several parents is drawn below the
    parent of the newest message, as in tf2.
    """
    by_child: dict[str, list[EdgeState]] = {}
    for edge in edges:
        by_child.setdefault(edge.child, []).append(edge)
    for some in by_child.values():
        some.sort(key=lambda edge: (edge.present is False, -edge.stream.arrivals.last_ns))
    parents = {
        child: edge.parent for child, edge in (planned or {}).items() if child not in by_child
    }
    parents |= {child: some[0].parent for child, some in by_child.items()}
    children = children_of(sorted((parent, child) for child, parent in parents.items()))

    def branch(frame: str, indent: str = "") -> Branch:
        observed = tuple(by_child.get(frame, ()))
        return Branch(frame, parents.get(frame), indent, observed, (planned or {}).get(frame))

    grown = [
        Tree(
            (
                branch(root),
                *(branch(frame, lines) for lines, frame in draw_tree(children, root, str)),
            )
        )
        for root in trees(zip(parents.values(), parents, strict=True))
    ]
    left = parents.keys() - {row.frame for tree in grown for row in tree.branches}
    for loop in loops((parents[frame], frame) for frame in left):
        rows = tuple(branch(frame) for frame in sorted(below(children, loop[0])))
        grown.append(Tree(rows, (*loop, loop[0])))
    return grown
