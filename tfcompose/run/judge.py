"""The guard's judgement: who may publish which edge, over what was seen.

It is given messages, the graph and the time, and returns events; it reads no clock and no topic, so that histories can
be replayed. Times are monotonic seconds, but for a message's source time, which is nanoseconds of the system clock.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING

from tfcompose.run.events import Clear, Found, GuardEvent, Recovered, Taken
from tfcompose.run.liveness import Liveness
from tfcompose.run.offences import Offence, taken, violation, volatile_writer

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tfcompose.plan import Plan, PlanEdge

#: How long a publisher may stay without a name before it is judged all the same.
NAMELESS_S = 0.7
#: For how long after the start a publisher can turn out to have been there first, and by how much it must have been.
FIRST_S = 15.0
FIRST_BY_NS = 500_000_000
#: How many messages it takes to tell from their count when a publisher began, and how long they are waited for.
COUNTED = 5
COUNTING_S = 0.5
#: A moving offence is over when nothing of it came for so long.
OVER_S = 3.0
UNCOUNTED = 2**64 - 1
#: The publishers that a plan starts once and never again.
_OWN = ("static", "joints")


@dataclass(frozen=True, slots=True)
class Message:
    """One TFMessage: its (parent, child) pairs, the topic's kind, who sent it, and when.

    ``gid`` is the publisher's id, or None where the rmw gives none; ``sequence`` counts its messages from 1.
    """

    edges: Sequence[tuple[str, str]]
    static: bool
    gid: bytes | None
    source_ns: int
    sequence: int


@dataclass(frozen=True, slots=True)
class Writer:
    """A publisher in the graph; ``node`` is None while its name is not known."""

    gid: bytes
    node: str | None
    static: bool
    volatile: bool


@dataclass(slots=True)
class _Sender:
    """One publisher by its id: when it was first heard, and how fast it counts."""

    first_seen: float
    first_ns: int
    first_sequence: int
    last_ns: int
    last_sequence: int

    def born_ns(self) -> int | None:
        """Return when its first message was sent, as far as its count tells; None: not yet known."""
        if self.first_sequence in {1, UNCOUNTED}:
            return self.first_ns
        counted = self.last_sequence - self.first_sequence
        if counted < COUNTED:
            return None
        return self.first_ns - (self.last_ns - self.first_ns) * (self.first_sequence - 1) // counted


@dataclass(slots=True)
class _Case:
    offence: Offence
    last: float


@dataclass(slots=True)
class Judge:
    """The state of one watch over one plan. ``settle_s`` is how long it looks before it says that all is clear."""

    plan: Plan
    settle_s: float
    begun: float
    begun_ns: int
    _cleared: float | None = None
    _cleared_ns: int = 0
    _senders: dict[bytes | None, _Sender] = field(default_factory=dict)
    _writers: dict[bytes, Writer] = field(default_factory=dict)
    _pending: dict[tuple[bytes | None, str, str, bool], float] = field(default_factory=dict)
    _cases: dict[tuple[str, str, str, str], _Case] = field(default_factory=dict)
    _owner_gids: dict[str, tuple[bytes, bytes | None]] = field(default_factory=dict)
    _volatile: set[bytes] = field(default_factory=set)
    _planned: dict[str, PlanEdge] = field(default_factory=dict)
    _started: dict[str, bool] = field(default_factory=dict)
    live: Liveness = field(init=False)

    def __post_init__(self) -> None:
        self.live = Liveness(self.plan)
        self._started = {process.name: process.kind != "external" for process in self.plan.processes}
        self._planned = {edge.child: edge for edge in self.plan.edges}

    def message(self, message: Message, now: float) -> list[GuardEvent]:
        """Take a message and return what it means."""
        self._count(message, now)
        node = self._node(message.gid, static=message.static)
        events: list[GuardEvent] = []
        offences: list[Offence] = []
        for parent, child in message.edges:
            if node is None:
                self._pending.setdefault((message.gid, parent, child, message.static), now)
                continue
            offence = self._offence(parent, child, node, message.gid, static=message.static)
            if offence is None:
                events += self.live.arrived(child, now) if child in self._planned else ()
            elif not self._known(offence, now):
                if self._too_early(message.gid, now):
                    self._pending.setdefault((message.gid, parent, child, message.static), now)
                else:
                    offences.append(offence)
        return [*events, *self._report(offences, message.gid, now)]

    def graph(self, writers: Sequence[Writer], now: float) -> list[GuardEvent]:
        """Take who publishes on /tf and /tf_static now, and return what that means."""
        self._writers = {writer.gid: writer for writer in writers}
        events = self._settle_pending(now)
        for writer in writers:
            if writer.static and writer.volatile and writer.node is not None and writer.gid not in self._volatile:
                self._volatile.add(writer.gid)
                events.append(Found(volatile_writer(writer.node, self.plan)))
        if self._cleared is not None:
            events += self.live.static_writers({w.node for w in writers if w.static and w.node is not None})
        return events

    def tick(self, now: float) -> list[GuardEvent]:
        """Return what the passing of time means."""
        events = self._settle_pending(now)
        if self._cleared is None:
            if now - self.begun >= self.settle_s and not self._pending:
                self._cleared = now
                self._cleared_ns = self.begun_ns + int((now - self.begun) * 1e9)
                events.append(Clear())
            return events
        return [*events, *self.live.judge(now), *self._over(now)]

    def _count(self, message: Message, now: float) -> None:
        sender = self._senders.get(message.gid)
        if sender is None:
            first = (now, message.source_ns, message.sequence)
            self._senders[message.gid] = _Sender(*first, message.source_ns, message.sequence)
        else:
            sender.last_ns, sender.last_sequence = message.source_ns, message.sequence

    def _node(self, gid: bytes | None, *, static: bool) -> str | None:
        """Return the publisher's node; where the rmw gives no id, the nodes that it may be, in one text."""
        if gid is not None:
            writer = self._writers.get(gid)
            return writer.node if writer else None
        names = sorted({w.node for w in self._writers.values() if w.static == static and w.node is not None})
        return f"one of {', '.join(names)}" if len(names) > 1 else names[0] if names else None

    def _offence(self, parent: str, child: str, node: str, gid: bytes | None, *, static: bool) -> Offence | None:
        edge = self._planned.get(child)
        if edge is None:
            return self._undeclared(parent, child, node, static=static)
        if parent != edge.parent:
            return Offence("TF802", parent, child, node, static, edge)
        if node != edge.node and not (gid is None and edge.node in node):
            return Offence("TF801", parent, child, node, static, edge)
        if self._is_namesake(edge, gid, static=static):
            return Offence("TF801", parent, child, f"another {edge.node}", static, edge)
        if static != (edge.kind == "static"):
            return Offence("TF809", parent, child, node, static, edge)
        return None

    def _is_namesake(self, edge: PlanEdge, gid: bytes | None, *, static: bool) -> bool:
        """Whether a publisher has the owner's name and is not the owner.

        It is where the plan starts the owner and this one spoke before; where two take turns: A, B, and A again; and
        where tfcompose's own publisher, which is never restarted, is there twice.
        """
        if gid is None:
            return False
        ours = self._started[edge.owner]
        if ours and (self._cleared is None or self._senders[gid].first_ns < self._cleared_ns):
            return True
        current, before = self._owner_gids.get(edge.child, (gid, None))
        if current != gid:
            self._owner_gids[edge.child] = (gid, current)
            return (before == gid and not static) or (edge.owner in _OWN and current in self._writers)
        self._owner_gids[edge.child] = (gid, before)
        return False

    def _undeclared(self, parent: str, child: str, node: str, *, static: bool) -> Offence | None:
        if self.plan.guard.unknown_edges == "ignore":
            return None
        for parents, children in self.plan.guard.allow:
            if fnmatchcase(parent, parents) and fnmatchcase(child, children):
                return None
        return Offence("TF803", parent, child, node, static, None)

    def _known(self, offence: Offence, now: float) -> bool:
        case = self._cases.get(offence.key)
        if case:
            case.last = now
        return case is not None

    def _too_early(self, gid: bytes | None, now: float) -> bool:
        """Whether more messages of this publisher can tell if it was there before the start."""
        sender = self._senders[gid]
        if self._cleared is None or now - self._cleared > FIRST_S:
            return False
        return sender.born_ns() is None and now - sender.first_seen < COUNTING_S

    def _settle_pending(self, now: float) -> list[GuardEvent]:
        """Judge what waited for a name, or for a second message."""
        events: list[GuardEvent] = []
        offences: dict[bytes | None, list[Offence]] = {}
        for (gid, parent, child, static), since in list(self._pending.items()):
            node = self._node(gid, static=static)
            late = now - since >= NAMELESS_S
            if (node is None or self._too_early(gid, now)) and not late:
                continue
            del self._pending[gid, parent, child, static]
            offence = self._offence(parent, child, node or "a publisher without a node name", gid, static=static)
            if offence is None:
                events += self.live.arrived(child, now) if child in self._planned else ()
            elif not self._known(offence, now):
                offences.setdefault(gid, []).append(offence)
        for gid, some in offences.items():
            events += self._report(some, gid, now)
        return events

    def _report(self, offences: list[Offence], gid: bytes | None, now: float) -> list[GuardEvent]:
        """Report new offences, those of one kind and node in one finding."""
        grouped: dict[tuple[str, str], list[Offence]] = {}
        for offence in offences:
            self._cases[offence.key] = _Case(offence, now)
            grouped.setdefault((offence.code, offence.node), []).append(offence)
        return [
            Taken(taken(some)) if self._was_first(some[0], gid, now) else Found(violation(some, self.plan.guard))
            for some in grouped.values()
        ]

    def _was_first(self, offence: Offence, gid: bytes | None, now: float) -> bool:
        """Whether the offender had the edge before the plan was started."""
        if offence.code not in {"TF801", "TF802"}:
            return False
        if self._cleared is None:
            return True
        born = self._senders[gid].born_ns()
        return now - self._cleared < FIRST_S and born is not None and born < self._cleared_ns - FIRST_BY_NS

    def _over(self, now: float) -> list[GuardEvent]:
        """Forget offences that have ended, and say so; the next of their kind is a new case."""
        present = {writer.node for writer in self._writers.values()}
        ended = [
            key
            for key, case in self._cases.items()
            if (case.offence.static and case.offence.node not in present and now - case.last > OVER_S)
            or (not case.offence.static and now - case.last > OVER_S)
        ]
        return [Recovered(self._cases.pop(key).offence.over) for key in ended]
