"""Observation of edges for monitor, verify, view and doctor: publisher, rate and delay of each.

An observer is given messages as they come, from a subscription or a bag, and who is in the graph;
it reads no clock and no topic. What it keeps does not grow with time, and with strange names up to
a bound only. Times are nanoseconds.
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


#: So long after an edge first came its times are not counted: a new subscriber gets at once what
#: was kept.
SETTLE_S = 0.3
#: A frame that stays in each parent for so many transforms, or more, in the mean, is handed over.
MIN_RUN = 3
#: A shorter quaternion is no rotation.
LEAST_LENGTH = 1e-9
_SECOND_NS = 1_000_000_000


def nearer_clock(
    rows: Sequence[Row], received_ns: int, clock_ns: int | None, *, static: bool
) -> int | None:
    """Return the time to compare stamps with.

    That of /clock where they are nearer to it, else None.
    """
    if clock_ns is None or static or not rows:
        return None
    stamp_ns = rows[0][2] * _SECOND_NS + rows[0][3]
    return clock_ns if abs(stamp_ns - clock_ns) < abs(stamp_ns - received_ns) else None


@dataclass(slots=True)
class EdgeStream:
    """An edge, as one publisher sends it on one kind of topic.

    Frames have the names that tf2 gives them: without the slash that some nodes write in front.

    Attributes:
        parent: the frame in which the pose is given.
        child: the frame whose pose it is.
        static: whether it came on /tf_static.
        gid: the publisher's id, 16 bytes; None where that is not known, as in a bag.
        arrivals: when it came; ``arrivals.count`` are all, ``arrivals.last_ns`` is when the newest
            came.
        first_ns: when the first message came, by the receiver's clock.
        row: the newest transform.
        stamp_ns: the newest message's stamp.
        newest_ns: the largest stamp so far.
        oldest_ns: the stamp of the first message.
        delay_ns: how old the newest message's stamp was when it came; negative: ahead of the
            receiver's clock.
        stamps_back: how many stamps were before the one that came before them.
        stamps_repeated: how many stamps were the one that came before them.
        rejected: why tf2 does not take it, the newest time that it did not.
        rejected_row: the newest that it did not take.
        rejections: how many were not taken.
        slashed: whether a name came with a slash in front.
        handover: the edges that put this frame in other parents, from the same publisher, and this
            one; None if none does.
        begun: how often this one came after another of them.
    """

    parent: str
    child: str
    static: bool
    gid: bytes | None
    arrivals: Arrivals
    first_ns: int
    row: Row
    newest_ns: int = -1
    stamp_ns: int = -1
    oldest_ns: int = -1
    delay_ns: int = 0
    stamps_back: int = 0
    stamps_repeated: int = 0
    rejected: Rejection | None = None
    rejected_row: Row | None = None
    rejections: int = 0
    slashed: bool = False
    handover: Handover | None = None
    begun: int = 0

    @property
    def is_taken(self) -> bool:
        """Whether tf2 takes any of it.

        tf2 on Jazzy makes a matrix of a quaternion before it looks at it, which normalises one of
        another length than 1; one of length 0 stays none.
        """
        if self.rejections < self.arrivals.count:
            return True
        is_rotation = norm(self.row[7:11]) > LEAST_LENGTH
        return self.rejected is Rejection.DENORMALISED and is_rotation

    @property
    def pose(self) -> Pose:
        """The newest pose of the child in the parent, as it was sent; nothing is normalised."""
        return Pose(self.row[4:7], self.row[7:11])

    @property
    def speed(self) -> float:
        """How fast its stamps advance, in seconds per second; 1 where that is unknown."""
        took_ns, stamped_ns = (
            self.arrivals.last_ns - self.first_ns,
            self.newest_ns - self.oldest_ns,
        )
        return stamped_ns / took_ns if took_ns > 0 and stamped_ns > 0 else 1.0

    def take(self, row: Row, received_ns: int, clock_ns: int) -> None:
        """Note a transform; ``clock_ns`` is the time that its stamp is compared with."""
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
            self.arrivals.resumed(received_ns)
        else:
            self.arrivals.arrived(received_ns, None if self.static else self.delay_ns)
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
        """Count the newest transform as one that tf2 does not take, if that is so."""
        why = rejection_of(self.parent, self.child, self.row[4:])
        if why is not None:
            self.rejected, self.rejected_row, self.rejections = why, self.row, self.rejections + 1


@dataclass(slots=True)
class Handover:
    """The edges with which one publisher puts one frame now in this parent, now in that.

    And which came last.
    """

    streams: list[EdgeStream]
    holder: EdgeStream

    def join(self, stream: EdgeStream) -> None:
        """Count an edge among them."""
        self.streams.append(stream)
        if len(self.streams) > 1:
            for each in self.streams:
                each.handover = self

    def take(self, stream: EdgeStream) -> bool:
        """Note a transform of one publisher; return whether the previous was another's."""
        if stream is self.holder:
            return False
        self.holder = stream
        stream.begun += 1
        return True

    @property
    def is_one(self) -> bool:
        """Whether the frame changes hands, now and then.

        Where one comes between the others, it jumps to and fro.
        """
        return all((each.begun - 1) * MIN_RUN <= each.arrivals.count for each in self.streams)


@dataclass(slots=True)
class Traffic:
    """How many messages a publisher sent on the topic of moving edges, and transforms in them."""

    messages: int = 0
    transforms: int = 0


@dataclass(frozen=True, slots=True)
class EdgeState:
    """What is known of an edge from one publisher at one time.

    ``nodes`` are the nodes of which one is the publisher: one where that is certain, none where
    nobody has a name. ``age_s`` is the time since the newest message came, ``data_age_s`` that
    since the newest stamp, None for fixed edges; ``present`` says that the publisher is in the
    graph, None where there is none to ask.
    """

    stream: EdgeStream
    nodes: tuple[str, ...]
    timing: Timing
    age_s: float
    data_age_s: float | None
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
        """The time since its first message came."""
        return self.age_s + (self.stream.arrivals.last_ns - self.stream.first_ns) * 1e-9

    @property
    def name(self) -> str:
        """The edge as people read it."""
        return f"{self.parent} → {self.child}"

    @property
    def publisher(self) -> str:
        """The publisher as people read it, empty where nothing is known."""
        return (
            self.nodes[0]
            if len(self.nodes) == 1
            else f"one of {', '.join(self.nodes)}"
            if self.nodes
            else ""
        )


@dataclass(slots=True)
class TreeObserver:
    """Everything that was observed of a TF tree.

    ``window_s`` is the stretch of time to which rates, jitter, gaps and delays refer (one to two
    of them); 0: all. Of the first ``settle_s`` of each edge they take nothing. ``end_ns`` is when
    a recording ended, of any topic; 0 for a running tree, of which ``observed_ns`` says when what
    had come was taken last. ``nodes`` are the names of all nodes in the graph, ``sent_joints`` who
    sent joint states, where that is observed. ``beyond`` counts
    the transforms of edges that are not kept, by their publisher's id: so many edges of one
    publisher, and of all together, are.
    """

    window_s: float = 0.0
    settle_s: float = 0.0
    messages: int = 0
    sent: dict[bytes | None, Traffic] = field(default_factory=dict)
    begun_ns: int = 0
    last_ns: int = 0
    end_ns: int = 0
    observed_ns: int = 0
    beyond: dict[bytes | None, int] = field(default_factory=dict)
    malformed: dict[bytes | None, int] = field(default_factory=dict)
    publishers: Publishers = field(default_factory=Publishers)
    nodes: tuple[str, ...] = ()
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
        """Take a message; ``clock_ns`` is the time that stamps should have.

        It is ``received_ns`` unless given.
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
        """Return the stream of an edge that is new, or written with a slash.

        None where there are too many.
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
        """Count a message that is no TFMessage."""
        if gid in self.malformed or len(self.malformed) < MOST_EDGES:
            self.malformed[gid] = self.malformed.get(gid, 0) + 1

    def take_graph(self, publishers: Sequence[Publisher], nodes: Sequence[str] = ()) -> None:
        """Take who is in the graph now, and the names of its nodes.

        What is known of one that has left is kept.
        """
        self.nodes = tuple(nodes)
        self.publishers.update(publishers)

    @property
    def until_ns(self) -> int:
        """Until when anything is known: the end of the recording, or the last look.

        Who looks late blames nobody.
        """
        return self.end_ns or self.observed_ns or self.last_ns

    @property
    def received_any(self) -> bool:
        """Whether anything came, be it readable or not."""
        return bool(self.messages or self.malformed)

    @property
    def recorded(self) -> bool:
        """Whether there is no graph to query, as with a recording."""
        return not self.publishers.queried

    @property
    def streams(self) -> tuple[EdgeStream, ...]:
        """Each edge of each publisher, in the order in which they came first."""
        return tuple(self._streams.values())

    def edges(self, now_ns: int) -> list[EdgeState]:
        """Return the state of each edge at ``now_ns`` of the receiver, by parent and child."""
        streams = sorted(self._streams.values(), key=_order)
        return [self._state(stream, now_ns) for stream in streams]

    def _state(self, stream: EdgeStream, now_ns: int) -> EdgeState:
        timing = stream.arrivals.timing(now_ns)
        age_s = max(0, now_ns - stream.arrivals.last_ns) * 1e-9
        # By the clock that its stamps were compared with: the last delay is that of the last
        # arrival.
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

        Without an id all on the topic, or all that were, where they have left.
        """
        nodes = self.publishers.nodes(stream.gid, static=stream.static)
        if nodes or stream.gid is not None:
            return nodes
        left = self.publishers.known.values()
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
    """A frame in a tree. ``indent`` draws the lines to it; ``parent`` is None for a root.

    ``observed`` are all who publish where it is, the one that counts first; ``planned`` is what
    was expected of it.
    """

    frame: str
    parent: str | None
    indent: str
    observed: tuple[EdgeState, ...] = ()
    planned: PlanEdge | None = None


@dataclass(frozen=True, slots=True)
class Tree:
    """One root and all below it, as it is drawn.

    Or the frames of a loop, the first one again last.
    """

    branches: tuple[Branch, ...]
    loop: tuple[str, ...] = ()


def forest(
    edges: Iterable[EdgeState], planned: Mapping[str, PlanEdge] | None = None
) -> list[Tree]:
    """Return the trees, the largest first, then the loops.

    Planned edges (by child) without messages are part of it.

    A frame with several parents is drawn below that of the newest message, as in tf2.
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
