"""The guard's judgement: who may publish which edge, over what was seen.

It is given messages, the graph and the time, and returns events; it reads no clock and no topic, so that histories can
be replayed. Times are monotonic seconds, but for those of messages, which are nanoseconds of the system clock.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from tfcompose.ipc import Clear, GuardEvent
from tfcompose.run.guard.cases import Cases, Start
from tfcompose.run.guard.endpoints import Endpoints
from tfcompose.run.guard.health import EdgeHealth
from tfcompose.run.guard.law import Law
from tfcompose.run.guard.liveness import Liveness
from tfcompose.run.guard.senders import Message, Senders, Writer
from tfcompose.run.guard.sent_poses import SentPoses
from tfcompose.run.guard.stamps import Clocks
from tfcompose.run.guard.streams import Stream, Streams
from tfcompose.verdict.offence import Offence
from tfcompose.verdict.violation import violation

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tfcompose.findings import Finding
    from tfcompose.plan import Plan

__all__ = ["Judge", "Message", "Writer"]

#: A guard that follows one that died misses nobody for so long: it takes that to find all nodes again.
FINDING_S = 5.0


@dataclass(slots=True)
class Judge:
    """The state of one watch over one plan. ``settle_s`` is how long it looks before it says that all is clear.

    ``says_who`` says whether the ids of messages are those of the graph; where they are not, they tell senders apart.
    ``admitted`` are the edges of the last message that may pass in a strict plan; None: all.
    """

    plan: Plan
    settle_s: float
    begun: float
    begun_ns: int
    says_who: bool = True
    live: Liveness = field(init=False)
    clocks: Clocks = field(init=False)
    cases: Cases = field(init=False)
    _start: Start = field(init=False)
    _senders: Senders = field(init=False)
    _law: Law = field(init=False)
    _streams: Streams = field(init=False)
    _endpoints: Endpoints = field(init=False)
    _sent: SentPoses = field(init=False)
    _finds_until: float = 0.0
    admitted: frozenset[tuple[str, str]] | None = None

    def __post_init__(self) -> None:
        self.live = Liveness(self.plan)
        self.clocks = Clocks(self.plan.ros.clock == "sim")
        self._start = Start(self.begun, self.begun_ns)
        self._senders = Senders(says_who=self.says_who)
        self.cases = Cases(self.plan, self._senders, self._start)
        self._law = Law(self.plan, self._senders, self._start)
        self._streams = Streams(self._law, self._senders, self.cases, self._start)
        self._endpoints = Endpoints(self.plan)
        self._sent = SentPoses(self.plan, self._senders)

    def message(self, message: Message, now: float) -> list[GuardEvent]:
        """Take a message and return which edges it brings to life; ``tick`` tells offences."""
        self._senders.heard(message, now)
        if message.poses:
            self._sent.take(message)
        stream = self._streams.take(message, now)
        self.admitted = stream.admitted
        if not stream.children:
            return []
        return self.live.arrived(stream.children, now, self._judge_stamps(stream, message, now))

    def admits(self, message: Message, now: float) -> frozenset[tuple[str, str]] | None:
        """Return which edges of the message may pass in a strict plan; None: all."""
        stream = Stream()
        self._streams.judge(stream, message, now)
        return stream.admitted

    def name_of(self, gid: bytes | None) -> str:
        """Return the publisher's node, or all that it may be; empty while that is not known."""
        return " or ".join(self._senders.nodes(gid, static=False)) if gid is not None else ""

    def graph(self, writers: Sequence[Writer], now: float) -> list[GuardEvent]:
        """Take who publishes on /tf and /tf_static now, and return what that means."""
        self._senders.graph(writers)
        events = [*self._see_again(now), *self._endpoints.misfits(writers)]
        if self._start.cleared is not None and now >= self._finds_until:
            events += self.live.static_writers({w.node for w in writers if w.static and w.node is not None})
        return events

    def clock(self, sim_ns: int | None, now: float) -> None:
        """Take the newest time on /clock; where that went back, stamps go back with it."""
        before = self.clocks.sim_ns
        self.clocks.take(sim_ns, now)
        if before is not None and sim_ns is not None and sim_ns < before:
            self._streams.forget_stamps()

    def leaks(self, writers: Sequence[Writer], topics: tuple[str, str]) -> list[GuardEvent]:
        """Take who publishes on the global topics while the plan's own (moving, static) are ``topics``."""
        return list(self._endpoints.leaks(writers, topics))

    def tick(self, now: float) -> list[GuardEvent]:
        """Return what the passing of time means."""
        events = [*self._see_again(now), *self.cases.report(now), *self._sent.judge()]
        if self._start.cleared is not None:
            over = self.cases.over(now)
            self._law.changes += bool(over)
            replaced = self._endpoints.replaced(self._senders, self.live.partly_missing(), now)
            silence = self.live.judge(now, self.clocks.speed(now), paused=self.clocks.stands(now))
            return [*events, *silence, *replaced, *over]
        self.live.look(now)
        if now - self.begun >= self.settle_s and not self._streams.waits and not self.cases.untold:
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

    def wrong(self) -> list[Finding]:
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
        return (self._law.changes, self.cases.changes, self.live.changes, self._endpoints.changes, *self._senders.mark)

    def memory(self) -> dict[str, Any]:
        """Return what the guard that follows this one must know, part by part, as values of JSON."""
        start = self._start
        return {
            "start": [start.begun, start.begun_ns, start.cleared, start.cleared_ns],
            "owners": self._law.owners.memory(),
            "senders": self._senders.memory(),
            "cases": self.cases.memory(),
            "told": self._endpoints.memory(),
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
        self._endpoints.recall(memory["told"])
        self.live.recall(memory["live"], now, self._finds_until)
        return [Clear()]

    # What is seen.

    def _see_again(self, now: float) -> list[GuardEvent]:
        """Judge what waited for a name."""
        return [event for children in self._streams.see_again(now) for event in self.live.arrived(children, now)]

    def _judge_stamps(self, stream: Stream, message: Message, now: float) -> float | None:
        """Judge the stamps of an owner's message, and return the age of the first in seconds, where it is known."""
        if message.static or not message.stamps_ns:
            return None
        # A message that waited for the guard says nothing of its sender's clock.
        clocks = Clocks(simulated=True) if self.live.is_behind(now) else self.clocks
        code, detail = stream.stamps.judge(message.stamps_ns, message.received_ns, clocks)
        if code:
            nodes = self._senders.nodes(message.gid, static=False)
            for child in stream.children:
                edge = self._law.planned[child]
                offence = Offence(code, edge.parent, child, nodes, static=False, edge=edge, detail=detail)
                self.cases.note(offence, message.gid, now)
        reference = clocks.reference_ns(message.received_ns)
        return None if reference is None else (reference - message.stamps_ns[0]) / 1e9
