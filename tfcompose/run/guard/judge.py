"""The guard's judgement: who may publish which edge, over what was seen.

It is given messages, the graph and the time, and returns events; it reads no clock and no topic, so that histories can
be replayed. Times are monotonic seconds, but for those of messages, which are nanoseconds of the system clock.

What was judged of a message holds for the next one of the same publisher with the same edges, until an owner, the
tree's shape or a case changes.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from tfcompose.ros.misfits import best_effort_writer, leak, volatile_writer
from tfcompose.run.events import Clear, Found, GuardEvent
from tfcompose.run.guard.cases import Case, Cases, Start
from tfcompose.run.guard.health import EdgeHealth
from tfcompose.run.guard.law import Law, Sight
from tfcompose.run.guard.liveness import Liveness
from tfcompose.run.guard.senders import Message, Senders, Writer
from tfcompose.run.guard.sent_poses import SentPoses
from tfcompose.run.guard.stamps import Clocks, Stamps
from tfcompose.verdict.offence import Offence
from tfcompose.verdict.violation import violation

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tfcompose.diagnostic import Diagnostic
    from tfcompose.plan import Plan

__all__ = ["Judge", "Message", "Writer"]

#: How long a publisher may stay without a name before it is judged all the same; longer if it may be the owner.
NAMELESS_S = 0.7
NAMELESS_OWNER_S = 5.0
#: For so many kinds of messages what was judged of them is remembered.
MOST_STREAMS = 4096
#: A guard that follows one that died misses nobody for so long: it takes that to find all publishers again.
FINDING_S = 5.0
#: What was judged of a message with edges that the plan does not have holds for so long.
STRANGE_S = 1.0


@dataclass(slots=True)
class _Stream:
    """A publisher's messages with the same edges; the verdict holds for a time, while nothing changes."""

    stamps: Stamps = field(default_factory=Stamps)
    epoch: int = -1
    until: float = 0.0
    cases: tuple[Case, ...] = ()
    children: tuple[str, ...] = ()
    admitted: frozenset[tuple[str, str]] | None = None


@dataclass(slots=True)
class Judge:
    """The state of one watch over one plan. ``settle_s`` is how long it looks before it says that all is clear.

    ``admitted`` are the edges of the last message that may pass in a strict plan; None: all.
    """

    plan: Plan
    settle_s: float
    begun: float
    begun_ns: int
    live: Liveness = field(init=False)
    clocks: Clocks = field(init=False)
    cases: Cases = field(init=False)
    _start: Start = field(init=False)
    _senders: Senders = field(default_factory=Senders)
    _pending: dict[Sight, float] = field(default_factory=dict)
    _streams: dict[tuple[bytes | None, bool, tuple[tuple[str, str], ...]], _Stream] = field(default_factory=dict)
    _told: set[tuple[str, bytes]] = field(default_factory=set)
    _law: Law = field(init=False)
    _sent: SentPoses = field(init=False)
    _finds_until: float = 0.0
    admitted: frozenset[tuple[str, str]] | None = None

    def __post_init__(self) -> None:
        self.live = Liveness(self.plan)
        self.clocks = Clocks(self.plan.ros.clock == "sim")
        self._start = Start(self.begun, self.begun_ns)
        self.cases = Cases(self.plan, self._senders, self._start)
        self._law = Law(self.plan, self._senders, self._start)
        self._sent = SentPoses(self.plan, self._senders)

    def message(self, message: Message, now: float) -> list[GuardEvent]:
        """Take a message and return which edges it brings to life; ``tick`` tells offences."""
        self._senders.heard(message, now)
        if message.poses:
            self._sent.take(message)
        key = (message.gid, message.static, message.edges)
        stream = self._streams.get(key)
        if stream is None:
            if len(self._streams) >= MOST_STREAMS:
                self._streams.clear()
            stream = self._streams[key] = _Stream()
        if stream.epoch != self._law.changes or now > stream.until:
            self._verdict(stream, message, now)
        for case in stream.cases:
            case.last = now
        self.admitted = stream.admitted
        if not stream.children:
            return []
        return self.live.arrived(stream.children, now, self._judge_stamps(stream, message, now))

    def admits(self, message: Message, now: float) -> frozenset[tuple[str, str]] | None:
        """Return which edges of the message may pass in a strict plan; None: all."""
        stream = _Stream()
        self._verdict(stream, message, now)
        return stream.admitted

    def name_of(self, gid: bytes | None) -> str:
        """Return the publisher's node, or all that it may be; empty while that is not known."""
        return " or ".join(self._senders.nodes(gid, static=False)) if gid is not None else ""

    def graph(self, writers: Sequence[Writer], now: float) -> list[GuardEvent]:
        """Take who publishes on /tf and /tf_static now, and return what that means."""
        self._senders.graph(writers)
        events = self._see_again(now)
        for writer in writers:
            if writer.node is None:
                continue
            if writer.static and writer.volatile:
                owned = [e.name for e in self.plan.edges if e.node == writer.node and e.kind == "static"]
                events += self._once("TF806", writer, volatile_writer(writer.node, "/tf_static", owned))
            if writer.best_effort:
                topic = "/tf_static" if writer.static else "/tf"
                events += self._once("TF826", writer, best_effort_writer(writer.node, topic))
        if self._start.cleared is not None and now >= self._finds_until:
            events += self.live.static_writers({w.node for w in writers if w.static and w.node is not None})
        return events

    def clock(self, sim_ns: int | None) -> None:
        """Take the newest time on /clock; where that went back, stamps go back with it."""
        before, self.clocks.sim_ns = self.clocks.sim_ns, sim_ns
        if before is not None and sim_ns is not None and sim_ns < before:
            for stream in self._streams.values():
                stream.stamps = Stamps()

    def leaks(self, writers: Sequence[Writer], topics: tuple[str, str]) -> list[GuardEvent]:
        """Take who publishes on the global topics while the plan's own (moving, static) are ``topics``."""
        nodes = {node for process in self.plan.processes for node in process.nodes}
        inside = f"/{self.plan.ros.namespace.strip('/')}/"
        events: list[GuardEvent] = []
        for writer in writers:
            ours = writer.node is not None and (writer.node in nodes or writer.node.startswith(inside))
            if ours and writer.node:
                topic = "/tf_static" if writer.static else "/tf"
                events += self._once("TF827", writer, leak(writer.node, topic, topics[writer.static]))
        return events

    def tick(self, now: float) -> list[GuardEvent]:
        """Return what the passing of time means."""
        events = [*self._see_again(now), *self.cases.report(now), *self._sent.judge()]
        if self._start.cleared is not None:
            over = self.cases.over(now)
            self._law.changes += bool(over)
            return [*events, *self.live.judge(now), *over]
        self.live.look(now)
        if now - self.begun >= self.settle_s and not self._pending and not self.cases.untold:
            self._start.clear(now)
            self._law.changes += 1
            events.append(Clear())
        return events

    def health(self, now: float) -> list[EdgeHealth]:
        """Return what is known of each planned edge, in the plan's order."""
        found = {}
        for track in self.live.tracks:
            age_s, rate = self.live.seconds_since(track, now) if track.live else (None, None)
            for edge in track.edges:
                names = self._senders.nodes(self._law.owners.current(edge.child), static=edge.kind == "static")
                publisher = names[0] if len(names) == 1 else edge.node
                found[edge.child] = EdgeHealth(
                    edge, publisher if track.live else "", rate, age_s, track.delay_s, track.silent, track.slow
                )
        return [found[edge.child] for edge in self.plan.edges]

    def wrong(self) -> list[Diagnostic]:
        """Return what was told and is not over, worst first; silence and low rates are part of ``health``."""
        told = [violation([case.offence], self.plan) for case in self.cases.open.values() if case.told]
        return sorted(told, key=lambda one: (one.severity, one.code))

    def absent(self, owner: str) -> None:
        """Take the owner as stopped on purpose; who publishes its edges next is no second one."""
        edges = self.plan.edges_of(owner)
        if edges:
            self.live.absent(owner)
        for edge in edges:
            self._law.owners.forget(edge.child)
        self._law.changes += 1

    # What the next guard must know.

    @property
    def mark(self) -> tuple[int, ...]:
        """What changes when there is more to remember."""
        return (self._law.changes, self.cases.changes, self.live.changes, len(self._told), *self._senders.mark)

    def memory(self) -> dict[str, Any]:
        """Return what the guard that follows this one must know, part by part, as values of JSON."""
        start, told = self._start, sorted([code, gid.hex()] for code, gid in self._told)
        return {
            "start": [start.begun, start.begun_ns, start.cleared, start.cleared_ns],
            "owners": self._law.owners.memory(),
            "senders": self._senders.memory(),
            "cases": self.cases.memory(),
            "told": told,
            "live": self.live.memory(),
        }

    def recall(self, memory: dict[str, Any], now: float) -> list[GuardEvent]:
        """Know what the guard before knew, and return that the look before the start is over."""
        self._finds_until = now + FINDING_S
        start = self._start
        start.begun, start.begun_ns, start.cleared, start.cleared_ns = memory["start"]
        self._law.owners.recall(memory["owners"])
        self._senders.recall(memory["senders"])
        self.cases.recall(memory["cases"], self._finds_until)
        self._told = {(code, bytes.fromhex(gid)) for code, gid in memory["told"]}
        self.live.recall(memory["live"], now, self._finds_until)
        return [Clear()]

    # What is seen.

    def _verdict(self, stream: _Stream, message: Message, now: float) -> None:
        """Judge the edges of a message whose sender has a name; the verdict holds if all is certain."""
        nodes = self._senders.nodes(message.gid, static=message.static)
        epoch, certain = self._law.changes, message.gid is not None
        cases, children, admitted = [], [], []
        for parent, child in dict.fromkeys(message.edges):
            sight = Sight(message.gid, parent, child, message.static)
            # Without ids, the sender may be one that the graph does not show yet.
            if not nodes or (message.gid is None and self._law.offence(sight, nodes, now)):
                self._pending.setdefault(sight, now)
                certain = False
                continue
            case, arrived = self._judge(sight, nodes, now)
            if case:
                cases.append(case)
                certain = certain and not case.offence.namesake
            else:
                admitted.append((parent, child))
            if arrived:
                children.append(child)
        stream.admitted = None if {*admitted} == {*message.edges} else frozenset(admitted)
        stream.cases, stream.children = tuple(cases), tuple(children)
        stream.epoch = epoch if certain and epoch == self._law.changes else -1
        strange = any(child not in self._law.planned for _, child in message.edges)
        stream.until = now + STRANGE_S if strange else float("inf")

    def _see_again(self, now: float) -> list[GuardEvent]:
        """Judge what waited for a name."""
        arrived: dict[bytes | None, list[str]] = {}
        for sight, since in list(self._pending.items()):
            nodes = self._senders.nodes(sight.gid, static=sight.static)
            if (nodes and sight.gid is not None) or now - since >= self._patience_s(sight, nodes):
                del self._pending[sight]
                if self._judge(sight, nodes, now)[1]:
                    arrived.setdefault(sight.gid, []).append(sight.child)
        return [event for children in arrived.values() for event in self.live.arrived(tuple(children), now)]

    def _judge_stamps(self, stream: _Stream, message: Message, now: float) -> float | None:
        """Judge the stamps of an owner's message, and return the age of the first in seconds, where it is known."""
        if message.static or not message.stamps_ns:
            return None
        code, detail = stream.stamps.judge(message.stamps_ns, message.received_ns, self.clocks)
        if code:
            nodes = self._senders.nodes(message.gid, static=False)
            for child in stream.children:
                edge = self._law.planned[child]
                offence = Offence(code, edge.parent, child, nodes, static=False, edge=edge, detail=detail)
                self.cases.note(offence, message.gid, now)
        reference = self.clocks.reference_ns(message.received_ns)
        return None if reference is None else (reference - message.stamps_ns[0]) / 1e9

    def _patience_s(self, sight: Sight, nodes: tuple[str, ...]) -> float:
        """Return how long to wait for the sender's name. One that may be the owner is not blamed in a hurry."""
        if nodes:
            return NAMELESS_S
        edge = self._law.planned.get(sight.child)
        if edge is None or not edge.may_hang_on(sight.parent):
            return NAMELESS_S
        known = self._law.owners.known(sight.child) and self._senders.is_present(self._law.owners.current(sight.child))
        early = self._start.cleared is None and self._law.started.get(edge.owner, False)
        return NAMELESS_S if known or early else NAMELESS_OWNER_S

    def _judge(self, sight: Sight, nodes: tuple[str, ...], now: float) -> tuple[Case | None, bool]:
        """Return the case that the sight is, if it is one, and whether the owner's edge has come."""
        offence = self._law.offence(sight, nodes, now)
        case = self.cases.note(offence, sight.gid, now) if offence else None
        planned = sight.child in self._law.planned
        # Of two that take turns either may be the owner; its edge is not silent.
        return case, planned and (offence is None or (offence.namesake and self._law.owners.known(sight.child)))

    def _once(self, code: str, writer: Writer, found: Diagnostic) -> list[GuardEvent]:
        """Return the finding about a publisher, the first time."""
        if (code, writer.gid) in self._told:
            return []
        self._told.add((code, writer.gid))
        return [Found(found)]
