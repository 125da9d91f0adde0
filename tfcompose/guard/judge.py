"""The guard's judgement: which node may publish which edge, message by message.

A judge takes messages, the ROS graph and the time, and returns events. It reads no clock and no
topic, so that recorded histories can be replayed. Times are monotonic seconds. Only the times of
messages are nanoseconds of the system clock. The judge's ledger holds the faults of edges.
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

#: After a new guard replaces a guard that died, no publisher counts as missing for this time, in
#: seconds, because the new guard has to discover all nodes.
FINDING_S = 5.0
#: After this time, in seconds, the guard stops waiting for a complete tree.
STARTING_S = 30.0


@dataclass(frozen=True, slots=True)
class JudgeMemory:
    """State for a new guard, for a pair of topics.

    The launcher stores it in parts. Ids of publishers are in hexadecimal.
    """

    start: StartTime
    #: Senders of each frame, the newest last.
    owners: dict[str, tuple[str, ...]]
    #: State of each publisher, by its id.
    senders: dict[str, SenderMemory]
    faults: dict[str, tuple[Fault, ...]]
    #: Codes and publishers of reported findings.
    reported: tuple[tuple[str, str], ...]
    live: LivenessMemory


def started_nodes(plan: Plan) -> dict[str, str]:
    """Return the processes that the plan starts, by node name."""
    return {node: process.name for process in plan.managed for node in process.nodes}


@dataclass(slots=True)
class Judge:
    """Judgement of a plan's edges on a pair of topics."""

    plan: Plan
    #: Duration of the observation before the start, in seconds.
    settle_s: float
    begun: float
    begun_ns: int
    #: Whether the ids of messages are the ids of publishers in the ROS graph. If not, they only
    #: distinguish senders.
    gid_identifies_node: bool = True
    #: Whether remappings isolate the plan's processes.
    remapped: bool = False
    live: Liveness = field(init=False)
    clocks: Clocks = field(init=False)
    ledger: Ledger = field(init=False)
    _start: StartTime = field(init=False)
    _senders: Senders = field(init=False)
    _publishers: PublisherReports = field(init=False)
    _sent: SentPoses = field(init=False)
    #: Processes that the plan starts, by node name.
    _started: dict[str, str] = field(init=False)
    _finds_until: float = 0.0

    def __post_init__(self) -> None:
        self.live = Liveness(self.plan)
        self.clocks = Clocks(self.plan.ros.clock == "sim")
        self._start = StartTime(self.begun, self.begun_ns)
        self._senders = Senders(gid_identifies_node=self.gid_identifies_node)
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
        """Judge a message and return the verdict, which decides how to forward the message.

        Pass both to ``judge_arrival`` afterwards. ``tick`` reports violations.
        """
        self._senders.heard(message, now)
        if message.poses:
            self._sent.take(message)
        return self.ledger.take(message, now)

    def judge_arrival(
        self, judged: JudgedMessage, message: Message, now: float
    ) -> list[GuardEvent]:
        """Judge the arrival of a message. Return events for edges that the message makes live."""
        if not judged.children:
            return []
        return self.live.note_arrivals(
            judged.children, now, self._judge_stamps(judged, message, now)
        )

    def admits(self, message: Message, now: float) -> frozenset[tuple[str, str]] | None:
        """Return the edges of the message that may pass in a strict plan, None for all edges."""
        judged = JudgedMessage()
        self.ledger.judge(judged, message, now)
        return judged.admitted

    def is_starting(self, now: float) -> bool:
        """Return whether processes wait for the guard's reports.

        They wait until the tree is complete, but no longer than ``STARTING_S``.
        """
        cleared = self._start.cleared
        return cleared is None or (now - cleared < STARTING_S and not self.live.is_complete)

    def next_tick(self, now: float, every_s: float) -> float:
        """Return when ``tick`` is next due, not later than the end of the observation."""
        end = self.begun + self.settle_s
        return (
            min(now + every_s, end) if self._start.cleared is None and end > now else now + every_s
        )

    @property
    def compared(self) -> frozenset[str]:
        """The frames whose poses the judge compares with the plan."""
        return self._sent.frames

    def name_of(self, gid: bytes | None) -> str:
        """Return the publisher's node, or all candidates; empty if unknown.

        The word "another" precedes the name if a different process uses the node name of the plan.
        """
        nodes = self._senders.nodes(gid, static=False) if gid is not None else ()
        process, is_ours = self._senders.process(gid), self._senders.is_ours(gid)
        if len(nodes) != 1 or is_ours is None or self._started.get(nodes[0], process) == process:
            return " or ".join(nodes)
        return f"another {nodes[0]}" + (f" of {process}" if process else "")

    def graph(self, publishers: Sequence[Publisher], now: float) -> list[GuardEvent]:
        """Process the current publishers on /tf and /tf_static; return the resulting events."""
        self._senders.update(publishers)
        events = [*self._recheck(now), *self._publishers.wrong_settings(publishers)]
        for report in self._publishers.leaving_the_fence(publishers, self._senders, now):
            # Report faults of its messages first, because it may be stopped before their report is
            # due.
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
        """Process the newest time on /clock. After it jumps back, stamps may go back, too."""
        before = self.clocks.sim_ns
        self.clocks.take(sim_ns, now)
        if before is not None and sim_ns is not None and sim_ns < before:
            self.ledger.forget_stamps()

    def leaks(self, publishers: Sequence[Publisher], topics: tuple[str, str]) -> list[GuardEvent]:
        """Process the publishers on the global topics if the plan uses the separate ``topics``."""
        return list(self._publishers.leaks(publishers, topics))

    def is_flooded_by(self, gid: bytes | None) -> bool:
        """Return whether the publisher exceeds the limit of undeclared edges."""
        return gid in self.ledger.flooders

    def report_flood(self, gid: bytes | None, transforms: int, now: float) -> None:
        """Count a message from a publisher that exceeds the limit of undeclared edges."""
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
        """Return the state of each planned edge, in the order of the plan."""
        statuses = {}
        for track in self.live.tracks:
            age_s, rate = self.live.seconds_since(track, now) if track.live else (None, None)
            for edge in track.edges:
                sender = self.ledger.frames.current_sender(edge.child)
                names = self._senders.nodes(sender, static=edge.kind == "static")
                publisher = names[0] if len(names) == 1 else edge.node
                statuses[edge.child] = EdgeHealth(
                    edge,
                    publisher if track.live else "",
                    rate,
                    age_s=age_s,
                    delay_s=track.delay_s,
                    silent=track.silent,
                    slow=track.slow,
                )
        return [statuses[edge.child] for edge in self.plan.edges]

    def wrong(self) -> list[Finding]:
        """Return the open findings, the worst first.

        ``health`` and ``live`` report silent and slow edges, which are not included here.
        """
        return self.ledger.wrong()

    def absent(self, owner: str) -> None:
        """Treat the owner as stopped on purpose.

        The next publisher of its edges may replace it.
        """
        edges = self.plan.edges_of(owner)
        if edges:
            self.live.absent(owner)
        self.ledger.forget_owners(edges)

    # State for a new guard.

    @property
    def mark(self) -> tuple[int, ...]:
        """A value that changes whenever the state for a new guard changes."""
        changes = (self.ledger.epoch, self.live.changes, self._publishers.changes)
        return (*changes, *self._senders.mark)

    def memory(self) -> JudgeMemory:
        """Return the state for a new guard."""
        return JudgeMemory(
            self._start,
            self.ledger.frames.memory(),
            self._senders.memory(),
            faults=self.ledger.memory(),
            reported=self._publishers.memory(),
            live=self.live.memory(),
        )

    def recall(self, memory: JudgeMemory, now: float) -> list[GuardEvent]:
        """Restore the previous guard's state; return the event that the observation is over."""
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
        """Judge messages that waited for a node's name."""
        return [
            event
            for children in self.ledger.recheck(now)
            for event in self.live.note_arrivals(children, now)
        ]

    def _judge_stamps(self, judged: JudgedMessage, message: Message, now: float) -> float | None:
        """Judge the stamps of an owner's message.

        Return the age of the first stamp in seconds, None if unknown.
        """
        if message.static or not message.stamps_ns:
            return None
        # The delay of a message that waited for the guard does not show that its sender's clock is
        # wrong.
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
