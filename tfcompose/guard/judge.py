"""The guard's judgement: who may publish which edge, and how, message by message.

A judge takes messages, the graph and the time, and returns events. It reads no clock and no topic,
so that histories can be replayed. Times are monotonic seconds, except those of messages, which are
nanoseconds of the system clock. Its ledger has the faults of edges.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from tfcompose.guard.before_start import StartTime
from tfcompose.guard.ledger import JudgedMessage, Ledger
from tfcompose.guard.liveness import EdgeHealth, Liveness, LivenessMemory
from tfcompose.guard.reports import PublisherReports
from tfcompose.guard.verdict.drivers import SentPoses
from tfcompose.guard.verdict.faults import Fault
from tfcompose.guard.verdict.stamps import Clocks
from tfcompose.model.messages import Clear, FindingShown, GuardEvent
from tfcompose.tf.live.publishers import SenderMemory, Senders

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tfcompose.foundation.findings import Finding
    from tfcompose.model.plan import Plan
    from tfcompose.tf.live.publishers import Message, Publisher

#: A guard that follows one that died misses no publisher for this long: it has to find all nodes
#: again.
FINDING_S = 5.0
#: A tree that is not complete after this long is no longer waited for, in seconds.
STARTING_S = 30.0


@dataclass(frozen=True, slots=True)
class JudgeMemory:
    """State for the next guard, of one pair of topics.

    The launcher keeps it, part by part. Ids of publishers are in hexadecimal.
    """

    start: StartTime
    #: The senders of each frame, the newest last.
    owners: dict[str, tuple[str, ...]]
    #: By publisher.
    senders: dict[str, SenderMemory]
    faults: dict[str, tuple[Fault, ...]]
    #: The reported codes and publishers.
    reported: tuple[tuple[str, str], ...]
    live: LivenessMemory


def started_nodes(plan: Plan) -> dict[str, str]:
    """Return the processes that the plan starts, by node."""
    return {node: process.name for process in plan.managed for node in process.nodes}


@dataclass(slots=True)
class Judge:
    """The state of a watch over a plan."""

    plan: Plan
    #: How long it observes before the start, in seconds.
    settle_s: float
    begun: float
    begun_ns: int
    #: True: the ids of messages are those of the graph. False: they only distinguish senders.
    says_who: bool = True
    #: True: remappings isolate the plan's processes.
    remapped: bool = False
    live: Liveness = field(init=False)
    clocks: Clocks = field(init=False)
    ledger: Ledger = field(init=False)
    _start: StartTime = field(init=False)
    _senders: Senders = field(init=False)
    _publishers: PublisherReports = field(init=False)
    _sent: SentPoses = field(init=False)
    #: The processes that the plan starts, by their nodes.
    _started: dict[str, str] = field(init=False)
    _finds_until: float = 0.0

    def __post_init__(self) -> None:
        self.live = Liveness(self.plan)
        self.clocks = Clocks(self.plan.ros.clock == "sim")
        self._start = StartTime(self.begun, self.begun_ns)
        self._senders = Senders(says_who=self.says_who)
        self.ledger = Ledger(self.plan, self._senders, self._start)
        self._publishers = PublisherReports(self.plan)
        self._sent = SentPoses(self.plan, self._senders)
        self._started = started_nodes(self.plan)

    def follow(self, plan: Plan) -> None:
        """Follow a plan that differs in lines and poses of edges, and in other processes."""
        self.plan = plan
        self._publishers.follow(plan)
        self._sent.follow(plan)
        self._started = started_nodes(plan)
        self.live.follow(plan)
        self.ledger.follow(plan)

    def take(self, message: Message, now: float) -> JudgedMessage:
        """Take a message and return the verdict on it, by which it can be forwarded.

        Pass both to ``judge_arrival`` afterwards; ``tick`` reports violations.
        """
        self._senders.heard(message, now)
        if message.poses:
            self._sent.take(message)
        return self.ledger.take(message, now)

    def judge_arrival(
        self, judged: JudgedMessage, message: Message, now: float
    ) -> list[GuardEvent]:
        """Judge the arrival of a taken message; return events for the edges that it makes live."""
        if not judged.children:
            return []
        return self.live.note_arrivals(
            judged.children, now, self._judge_stamps(judged, message, now)
        )

    def admits(self, message: Message, now: float) -> frozenset[tuple[str, str]] | None:
        """Return which edges of the message may pass in a strict plan; None: all."""
        judged = JudgedMessage()
        self.ledger.judge(judged, message, now)
        return judged.admitted

    def is_starting(self, now: float) -> bool:
        """Return whether processes wait for its reports: until the tree is complete, or late."""
        cleared = self._start.cleared
        return cleared is None or (now - cleared < STARTING_S and not self.live.is_complete)

    def next_tick(self, now: float, every_s: float) -> float:
        """Return when ``tick`` is due, at the latest at the end of the observation."""
        end = self.begun + self.settle_s
        return (
            min(now + every_s, end) if self._start.cleared is None and end > now else now + every_s
        )

    @property
    def compared(self) -> frozenset[str]:
        """The frames whose poses it compares with the plan's."""
        return self._sent.frames

    def name_of(self, gid: bytes | None) -> str:
        """Return the publisher's node, or all candidates; empty while unknown.

        A publisher with the name of a process's node, but of another process, is "another" one.
        """
        nodes = self._senders.nodes(gid, static=False) if gid is not None else ()
        process, is_ours = self._senders.process(gid), self._senders.is_ours(gid)
        if len(nodes) != 1 or is_ours is None or self._started.get(nodes[0], process) == process:
            return " or ".join(nodes)
        return f"another {nodes[0]}" + (f" of {process}" if process else "")

    def graph(self, publishers: Sequence[Publisher], now: float) -> list[GuardEvent]:
        """Take the current publishers on /tf and /tf_static; return the events that follow."""
        self._senders.update(publishers)
        events = [*self._recheck(now), *self._publishers.wrong_settings(publishers)]
        for report in self._publishers.leaving_the_fence(publishers, self._senders, now):
            # Report its messages first: it may be stopped before their own report is due.
            events += self.ledger.report(now, at_once=report.gid)
            events += self._publishers.report_unfenced(report, remapped=self.remapped)
        if self._start.cleared is not None and now >= self._finds_until:
            events += self.live.static_writers(
                {
                    publisher.node
                    for publisher in publishers
                    if publisher.static and publisher.node is not None
                }
            )
        return events

    def clock(self, sim_ns: int | None, now: float) -> None:
        """Take the newest time on /clock. After it jumps back, stamps may go back too."""
        before = self.clocks.sim_ns
        self.clocks.take(sim_ns, now)
        if before is not None and sim_ns is not None and sim_ns < before:
            self.ledger.forget_stamps()

    def leaks(self, publishers: Sequence[Publisher], topics: tuple[str, str]) -> list[GuardEvent]:
        """Take the publishers on the global topics while the plan's own are ``topics``."""
        return list(self._publishers.leaks(publishers, topics))

    def is_flooded_by(self, gid: bytes | None) -> bool:
        """Return whether the publisher has published more undeclared edges than are judged."""
        return gid in self.ledger.flooders

    def report_flood(self, gid: bytes | None, transforms: int, now: float) -> None:
        """Take a message from a publisher with more undeclared edges than are judged."""
        self.ledger.count_flood(gid, transforms, now)

    def tick(self, now: float) -> list[GuardEvent]:
        """Return the events that are due at this time."""
        events = [
            *self._recheck(now),
            *self.ledger.report(now),
            *map(FindingShown, self._sent.judge()),
        ]
        events += self._publishers.floods(self._senders, self.ledger.flooders, now)
        if self._start.cleared is not None:
            over = self.ledger.over(now)
            replaced = self._publishers.report_replaced(
                self._senders, self.live.partly_missing(), now
            )
            silence = self.live.judge(now, self.clocks.speed(now), paused=self.clocks.stands(now))
            return [*events, *silence, *replaced, *over]
        self.live.tick(now)
        if now >= self.begun + self.settle_s and self.ledger.is_settled:
            self.ledger.clear(now)
            events.append(Clear())
        return events

    def health(self, now: float) -> list[EdgeHealth]:
        """Return the state of each planned edge, in the plan's order."""
        found = {}
        for track in self.live.tracks:
            age_s, rate = self.live.seconds_since(track, now) if track.live else (None, None)
            for edge in track.edges:
                sender = self.ledger.frames.current_sender(edge.child)
                names = self._senders.nodes(sender, static=edge.kind == "static")
                publisher = names[0] if len(names) == 1 else edge.node
                found[edge.child] = EdgeHealth(
                    edge,
                    publisher if track.live else "",
                    rate,
                    age_s=age_s,
                    delay_s=track.delay_s,
                    silent=track.silent,
                    slow=track.slow,
                )
        return [found[edge.child] for edge in self.plan.edges]

    def wrong(self) -> list[Finding]:
        """Return the open findings, worst first.

        Silence and low rates are not among them: ``health`` and ``live`` have those.
        """
        return self.ledger.wrong()

    def absent(self, owner: str) -> None:
        """Treat the owner as stopped on purpose: the next publisher of its edges replaces it."""
        edges = self.plan.edges_of(owner)
        if edges:
            self.live.absent(owner)
        self.ledger.forget_owners(edges)

    # State for the next guard.

    @property
    def mark(self) -> tuple[int, ...]:
        """A value that changes whenever the state for the next guard does."""
        changes = (self.ledger.epoch, self.live.changes, self._publishers.changes)
        return (*changes, *self._senders.mark)

    def memory(self) -> JudgeMemory:
        """Return the state for the next guard."""
        return JudgeMemory(
            self._start,
            self.ledger.frames.memory(),
            self._senders.memory(),
            faults=self.ledger.memory(),
            reported=self._publishers.memory(),
            live=self.live.memory(),
        )

    def recall(self, memory: JudgeMemory, now: float) -> list[GuardEvent]:
        """Restore the previous guard's state; return that the initial observation is over."""
        self._finds_until = now + FINDING_S
        begun = memory.start
        self._start.begun, self._start.begun_ns = begun.begun, begun.begun_ns
        self._start.cleared, self._start.cleared_ns = begun.cleared, begun.cleared_ns
        self.ledger.frames.recall(memory.owners)
        self._senders.recall(memory.senders)
        self.ledger.recall(memory.faults, self._finds_until)
        self._publishers.recall(memory.reported)
        self.live.recall(memory.live, now, self._finds_until)
        return [Clear()]

    # Observations.

    def _recheck(self, now: float) -> list[GuardEvent]:
        """Judge messages that waited for a node name."""
        return [
            event
            for children in self.ledger.recheck(now)
            for event in self.live.note_arrivals(children, now)
        ]

    def _judge_stamps(self, judged: JudgedMessage, message: Message, now: float) -> float | None:
        """Judge the stamps of an owner's message.

        Return the age of the first in seconds, if known.
        """
        if message.static or not message.stamps_ns:
            return None
        # A message that waited for the guard says nothing of its sender's clock.
        clocks = Clocks(simulated=True) if self.live.is_behind(now) else self.clocks
        code, detail = judged.stamps.judge(message.stamps_ns, message.received_ns, clocks)
        if code:
            nodes = self._senders.nodes(message.gid, static=False)
            for child in judged.children:
                edge = self.ledger.planned[child]
                fault = Fault(
                    code, edge.parent, child, nodes=nodes, static=False, edge=edge, detail=detail
                )
                self.ledger.note(fault, message.gid, now)
        reference = clocks.reference_ns(message.received_ns)
        return None if reference is None else (reference - message.stamps_ns[0]) / 1e9
