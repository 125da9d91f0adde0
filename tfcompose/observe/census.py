"""Who publishes which edge, how often and how late: what monitor, verify, the live tree and doctor look at.

A census is given messages as they come, from a subscription or a bag, and who is in the graph; it reads no clock and
no topic. What it keeps does not grow with time, and with strange names up to a bound only. Times are nanoseconds.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from tfcompose.observe.strand import Strand, Turns
from tfcompose.observe.tally import Tally, Timing

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from tfcompose.ros.tf_codec import Row

#: So many edges are kept, counting an edge once for each publisher; what comes beyond is counted only.
MOST_STRANDS = 20_000
#: So long after an edge first came its times are not counted: who joins a running tree gets at once what was kept.
SETTLE_S = 0.3
_SECOND_NS = 1_000_000_000


def topics_below(namespace: str) -> tuple[str, str]:
    """Return the topics of moving and of fixed edges below a namespace."""
    prefix = f"/{namespace.strip('/')}" if namespace.strip("/") else ""
    return f"{prefix}/tf", f"{prefix}/tf_static"


def nearer_clock(rows: Sequence[Row], received_ns: int, clock_ns: int | None, *, static: bool) -> int | None:
    """Return the time to compare stamps with: that of /clock where they are nearer to it, else None."""
    if clock_ns is None or static or not rows:
        return None
    stamp_ns = rows[0][2] * _SECOND_NS + rows[0][3]
    return clock_ns if abs(stamp_ns - clock_ns) < abs(stamp_ns - received_ns) else None


@dataclass(frozen=True, slots=True)
class Publisher:
    """One publisher on a TF topic, as the graph shows it.

    ``node`` is its node's full name, None while that is not known. ``static`` says that it is one of /tf_static,
    ``latched`` and ``reliable`` are its QoS. ``where`` says on which machine and as which process it runs, empty where
    that is not known. ``topic`` and ``type`` are the full names of its topic and its type.
    """

    gid: bytes
    node: str | None
    static: bool
    latched: bool = True
    reliable: bool = True
    where: str = ""
    topic: str = ""
    type: str = ""


@dataclass(frozen=True, slots=True)
class EdgeSeen:
    """What is known of a strand at one time.

    ``nodes`` are the nodes of which one is the publisher: one where that is certain, none where nobody has a name.
    ``age_s`` is the time since the newest message came, ``data_age_s`` that since the newest stamp, None for fixed
    edges; ``present`` says that the publisher is in the graph, None where there is none to ask.
    """

    strand: Strand
    nodes: tuple[str, ...]
    timing: Timing
    age_s: float
    data_age_s: float | None
    present: bool | None = None

    @property
    def known_s(self) -> float:
        """The time since its first message came."""
        return self.age_s + (self.strand.tally.last_ns - self.strand.first_ns) * 1e-9

    @property
    def name(self) -> str:
        """The edge as people read it."""
        return f"{self.strand.parent} → {self.strand.child}"

    @property
    def publisher(self) -> str:
        """The publisher as people read it, empty where nothing is known."""
        return self.nodes[0] if len(self.nodes) == 1 else f"one of {', '.join(self.nodes)}" if self.nodes else ""


@dataclass(slots=True)
class Census:
    """Everything that was seen of a TF tree.

    ``window_s`` is the stretch of time of which rates, jitter, gaps and delays are told (one to two of them); 0: all.
    Of the first ``settle_s`` of each edge they tell nothing. ``end_ns`` is when a recording ended, of any topic; 0 for
    a running tree.
    """

    window_s: float = 0.0
    settle_s: float = 0.0
    messages: int = 0
    begun_ns: int = 0
    last_ns: int = 0
    end_ns: int = 0
    beyond: int = 0
    malformed: dict[bytes | None, int] = field(default_factory=dict)
    publishers: dict[bytes, Publisher] = field(default_factory=dict)
    others: tuple[str, ...] = ()
    present: frozenset[bytes] | None = None
    _strands: dict[tuple[str, str, bytes | None, bool], Strand] = field(default_factory=dict)
    _turns: dict[tuple[str, bytes], Turns] = field(default_factory=dict)

    def take(
        self, rows: Iterable[Row], *, static: bool, gid: bytes | None, received_ns: int, clock_ns: int | None = None
    ) -> None:
        """Take one message; ``clock_ns`` is the time that stamps should have, ``received_ns`` unless that is given."""
        self.begun_ns = self.begun_ns or received_ns
        self.messages += 1
        self.last_ns = received_ns
        clock = received_ns if clock_ns is None else clock_ns
        strands = self._strands
        for row in rows:
            strand = strands.get((row[0], row[1], gid, static))
            if strand is None:
                strand = self._met(row, static=static, gid=gid, received_ns=received_ns)
                if strand is None:
                    self.beyond += 1
                    continue
            strand.take(row, received_ns, clock)

    def _met(self, row: Row, *, static: bool, gid: bytes | None, received_ns: int) -> Strand | None:
        """Return the strand of an edge that is new, or written with a slash; None where there are too many."""
        parent, child = row[0].removeprefix("/"), row[1].removeprefix("/")
        strand = self._strands.get((parent, child, gid, static))
        if strand is None:
            if len(self._strands) >= MOST_STRANDS:
                return None
            tally = Tally(int(self.window_s * _SECOND_NS), int(self.settle_s * _SECOND_NS))
            strand = Strand(parent, child, static, gid, tally, received_ns, row)
            self._strands[parent, child, gid, static] = strand
            if gid is not None and not static:
                self._turns.setdefault((child, gid), Turns([], strand)).join(strand)
        if (parent, child) != row[:2]:
            strand.slashed = True
        return strand

    def take_malformed(self, gid: bytes | None) -> None:
        """Count a message that is no TFMessage."""
        if gid in self.malformed or len(self.malformed) < MOST_STRANDS:
            self.malformed[gid] = self.malformed.get(gid, 0) + 1

    def graph(self, publishers: Sequence[Publisher], nodes: Sequence[str] = ()) -> None:
        """Take who is in the graph now, and the names of its nodes; what is known of one that has left is kept."""
        self.others = tuple(nodes)
        self.present = frozenset(each.gid for each in publishers)
        for each in publishers:
            known = self.publishers.get(each.gid)
            if known is None and len(self.publishers) >= MOST_STRANDS:
                self.publishers = {gid: one for gid, one in self.publishers.items() if gid in self.present}
            if known is None or each.node is not None:
                self.publishers[each.gid] = each

    @property
    def heard(self) -> bool:
        """Whether anything came, be it readable or not."""
        return bool(self.messages or self.malformed)

    def is_known(self, gid: bytes | None) -> bool:
        """Whether the publisher's node has a name."""
        known = self.publishers.get(gid) if gid is not None else None
        return known is not None and known.node is not None

    def nodes(self, gid: bytes | None, *, static: bool) -> tuple[str, ...]:
        """Return the publisher's node; where there is no id, all on the topic; nothing while none has a name."""
        if gid is not None:
            known = self.publishers.get(gid)
            return (known.node,) if known is not None and known.node is not None else ()
        names = {each.node for each in self.publishers.values() if each.static == static and each.node is not None}
        return tuple(sorted(names))

    def edges(self, now_ns: int) -> list[EdgeSeen]:
        """Return what is known of each edge at ``now_ns`` of the receiver's clock, sorted by parent and child."""
        strands = sorted(self._strands.values(), key=_order)
        return [self._seen(strand, now_ns) for strand in strands]

    def _seen(self, strand: Strand, now_ns: int) -> EdgeSeen:
        timing = strand.tally.timing(now_ns)
        age_s = max(0, now_ns - strand.tally.last_ns) * 1e-9
        # By the clock that its stamps were compared with: the last delay is that of the last arrival.
        data_age_s = None if strand.static else age_s + strand.lag_ns * 1e-9
        present = None if self.present is None or strand.gid is None else strand.gid in self.present
        return EdgeSeen(strand, self.nodes(strand.gid, static=strand.static), timing, age_s, data_age_s, present)


def _order(strand: Strand) -> tuple[str, str, bool, int]:
    return strand.parent, strand.child, not strand.static, strand.first_ns
