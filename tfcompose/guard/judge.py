"""The guard's judgement: who may publish which edge, and how, message by message.

What was judged of a message holds for the next one of the same publisher with the same edges,
until an owner, the tree's shape or a case changes. What has a sender without a name waits for
that, for a while.

A judge is given messages, the graph and the time, and returns events; it reads no clock and no
topic, so that histories can be replayed. Times are monotonic seconds, but for those of messages,
which are nanoseconds of the system clock.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from tfcompose.guard.liveness import EdgeHealth, Liveness, LivenessMemory
from tfcompose.guard.reports import CaseMemory, Cases, Flood, PublisherReports
from tfcompose.guard.verdict.drivers import SentPoses
from tfcompose.guard.verdict.ownership import (
    MOST_UNDECLARED,
    OwnershipRules,
    SentEdge,
    Start,
    Violation,
)
from tfcompose.guard.verdict.stamps import Clocks, StampHistory
from tfcompose.model.messages import Clear, Found, GuardEvent
from tfcompose.tf.live.publishers import NAMELESS_S, SenderMemory, Senders

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tfcompose.foundation.findings import Finding
    from tfcompose.guard.reports import Case
    from tfcompose.model.plan import Plan
    from tfcompose.tf.live.publishers import Message, Publisher

    Edges = tuple[tuple[str, str], ...]

#: A guard that follows one that died misses nobody for so long: it takes that to find all nodes
#: again.
FINDING_S = 5.0
#: How long a publisher that may be the owner can stay without a name before it is judged all the
#: same.
NAMELESS_OWNER_S = 5.0
#: For so many kinds of messages what was judged of them is remembered.
MOST_VERDICTS = 4096
#: These messages have so many edges at most, together.
MOST_VERDICT_EDGES = 200_000
#: What was judged of a message with edges that the plan does not have holds for so long.
STRANGE_S = 1.0


@dataclass(frozen=True, slots=True)
class JudgeMemory:
    """What the guard that follows this one must know of one pair of topics; the launcher keeps it, part by part.

    ``owners`` holds by frame who sent it, the last one last, ``senders`` are by publishers' ids,
    ``reported`` publishers.
    """

    start: Start
    owners: dict[str, tuple[str, ...]]
    senders: dict[str, SenderMemory]
    cases: tuple[CaseMemory, ...]
    reported: tuple[tuple[str, str], ...]
    live: LivenessMemory


@dataclass(slots=True)
class Judge:
    """The state of one watch over one plan. ``settle_s`` is how many seconds it observes before it reports all clear.

    ``says_who`` says whether the ids of messages are those of the graph; where they are not, they
    tell senders apart. ``remapped`` says that what the plan's processes send is fenced off by
    remappings. ``admitted`` are the edges of the last message that may pass in a strict plan;
    None: all.
    """

    plan: Plan
    settle_s: float
    begun: float
    begun_ns: int
    says_who: bool = True
    remapped: bool = False
    live: Liveness = field(init=False)
    clocks: Clocks = field(init=False)
    cases: Cases = field(init=False)
    _start: Start = field(init=False)
    _senders: Senders = field(init=False)
    _rules: OwnershipRules = field(init=False)
    _verdicts: Verdicts = field(init=False)
    _publishers: PublisherReports = field(init=False)
    _sent: SentPoses = field(init=False)
    #: The processes that the plan starts, by their nodes.
    _started: dict[str, str] = field(init=False)
    _finds_until: float = 0.0
    admitted: frozenset[tuple[str, str]] | None = None

    def __post_init__(self) -> None:
        self.live = Liveness(self.plan)
        self.clocks = Clocks(self.plan.ros.clock == "sim")
        self._start = Start(self.begun, self.begun_ns)
        self._senders = Senders(says_who=self.says_who)
        self.cases = Cases(self.plan, self._senders, self._start)
        self._rules = OwnershipRules(self.plan, self._senders, self._start)
        self._verdicts = Verdicts(self._rules, self._senders, self.cases, self._start)
        self._publishers = PublisherReports(self.plan)
        self._sent = SentPoses(self.plan, self._senders)
        self._started = {node: each.name for each in self.plan.managed for node in each.nodes}

    def message(self, message: Message, now: float) -> list[GuardEvent]:
        """Take a message and return which edges it brings to life; ``tick`` reports violations."""
        self._senders.heard(message, now)
        if message.poses:
            self._sent.take(message)
        verdict = self._verdicts.take(message, now)
        self.admitted = verdict.admitted
        if not verdict.children:
            return []
        return self.live.arrived(verdict.children, now, self._judge_stamps(verdict, message, now))

    def admits(self, message: Message, now: float) -> frozenset[tuple[str, str]] | None:
        """Return which edges of the message may pass in a strict plan; None: all."""
        verdict = Verdict()
        self._verdicts.judge(verdict, message, now)
        return verdict.admitted

    @property
    def compared(self) -> frozenset[str]:
        """The frames whose poses it compares with the plan's."""
        return self._sent.frames

    def name_of(self, gid: bytes | None) -> str:
        """Return the publisher's node, or all that it may be; empty while that is not known.

        One with the name of a process's node that is not of that process is another one.
        """
        nodes = self._senders.nodes(gid, static=False) if gid is not None else ()
        process, is_ours = self._senders.process(gid), self._senders.is_ours(gid)
        if len(nodes) != 1 or is_ours is None or self._started.get(nodes[0], process) == process:
            return " or ".join(nodes)
        return f"another {nodes[0]}" + (f" of {process}" if process else "")

    def graph(self, publishers: Sequence[Publisher], now: float) -> list[GuardEvent]:
        """Take who publishes on /tf and /tf_static now, and return what that means."""
        self._senders.update(publishers)
        events = [*self._see_again(now), *self._publishers.wrong_settings(publishers)]
        for one in self._publishers.leaving_the_fence(publishers, self._senders, now):
            # What it has sent is reported first: it can be stopped for this before that is due.
            events += self.cases.report(now, at_once=one.gid)
            events += self._publishers.unfenced(one, remapped=self.remapped)
        if self._start.cleared is not None and now >= self._finds_until:
            events += self.live.static_writers(
                {one.node for one in publishers if one.static and one.node is not None}
            )
        return events

    def clock(self, sim_ns: int | None, now: float) -> None:
        """Take the newest time on /clock; where that went back, stamps go back with it."""
        before = self.clocks.sim_ns
        self.clocks.take(sim_ns, now)
        if before is not None and sim_ns is not None and sim_ns < before:
            self._verdicts.forget_stamps()

    def leaks(self, publishers: Sequence[Publisher], topics: tuple[str, str]) -> list[GuardEvent]:
        """Take who publishes on the global topics while the plan's own (moving, static) are ``topics``."""
        return list(self._publishers.leaks(publishers, topics))

    def is_flooded_by(self, gid: bytes | None) -> bool:
        """Return whether the publisher has published more undeclared edges than are judged."""
        return gid in self._verdicts.flooders

    def flooded_by(self, gid: bytes | None, transforms: int, now: float) -> None:
        """Take a message of so many transforms from a publisher of more undeclared edges than are judged."""
        self._verdicts.flooders.setdefault(gid, Flood(now)).count(transforms, now)

    def tick(self, now: float) -> list[GuardEvent]:
        """Return what the passing of time means."""
        events = [*self._see_again(now), *self.cases.report(now), *map(Found, self._sent.judge())]
        events += self._publishers.floods(self._senders, self._verdicts.flooders, now)
        if self._start.cleared is not None:
            over = self.cases.over(now)
            self._rules.changes += bool(over)
            replaced = self._publishers.replaced(self._senders, self.live.partly_missing(), now)
            silence = self.live.judge(now, self.clocks.speed(now), paused=self.clocks.stands(now))
            return [*events, *silence, *replaced, *over]
        self.live.tick(now)
        if (
            now - self.begun >= self.settle_s
            and not self._verdicts.waits
            and not self.cases.unreported
        ):
            self._start.clear(now)
            self._rules.changes += 1
            events.append(Clear())
        return events

    def health(self, now: float) -> list[EdgeHealth]:
        """Return what is known of each planned edge, in the plan's order."""
        found = {}
        for track in self.live.tracks:
            age_s, rate = self.live.seconds_since(track, now) if track.live else (None, None)
            for edge in track.edges:
                names = self._senders.nodes(
                    self._rules.owners.current(edge.child), static=edge.kind == "static"
                )
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
        """Return what was reported and is not over, worst first; silence and low rates are part of ``health``."""
        return sorted(self.cases.wrong(), key=lambda finding: (finding.severity, finding.code))

    def absent(self, owner: str) -> None:
        """Take the owner as stopped on purpose; who publishes its edges next is no second one."""
        edges = self.plan.edges_of(owner)
        if edges:
            self.live.absent(owner)
        for edge in edges:
            self._rules.owners.forget(edge.child)
        self._rules.changes += 1

    # What the next guard must know.

    @property
    def mark(self) -> tuple[int, ...]:
        """What changes when there is more to remember."""
        changes = (one.changes for one in (self._rules, self.cases, self.live, self._publishers))
        return (*changes, *self._senders.mark)

    def memory(self) -> JudgeMemory:
        """Return what the guard that follows this one must know."""
        return JudgeMemory(
            self._start,
            self._rules.owners.memory(),
            self._senders.memory(),
            cases=self.cases.memory(),
            reported=self._publishers.memory(),
            live=self.live.memory(),
        )

    def recall(self, memory: JudgeMemory, now: float) -> list[GuardEvent]:
        """Restore the state of the guard before this one, and return that the observation before the start is over."""
        self._finds_until = now + FINDING_S
        begun = memory.start
        self._start.begun, self._start.begun_ns = begun.begun, begun.begun_ns
        self._start.cleared, self._start.cleared_ns = begun.cleared, begun.cleared_ns
        self._rules.owners.recall(memory.owners)
        self._senders.recall(memory.senders)
        self.cases.recall(memory.cases, self._finds_until)
        self._publishers.recall(memory.reported)
        self.live.recall(memory.live, now, self._finds_until)
        return [Clear()]

    # What is seen.

    def _see_again(self, now: float) -> list[GuardEvent]:
        """Judge what waited for a name."""
        return [
            event
            for children in self._verdicts.see_again(now)
            for event in self.live.arrived(children, now)
        ]

    def _judge_stamps(self, verdict: Verdict, message: Message, now: float) -> float | None:
        """Judge the stamps of an owner's message, and return the age of the first in seconds, where it is known."""
        if message.static or not message.stamps_ns:
            return None
        # A message that waited for the guard says nothing of its sender's clock.
        clocks = Clocks(simulated=True) if self.live.is_behind(now) else self.clocks
        code, detail = verdict.stamps.judge(message.stamps_ns, message.received_ns, clocks)
        if code:
            nodes = self._senders.nodes(message.gid, static=False)
            for child in verdict.children:
                edge = self._rules.planned[child]
                violation = Violation(
                    code, edge.parent, child, nodes, static=False, edge=edge, detail=detail
                )
                self.cases.note(violation, message.gid, now)
        reference = clocks.reference_ns(message.received_ns)
        return None if reference is None else (reference - message.stamps_ns[0]) / 1e9


@dataclass(slots=True)
class Verdict:
    """What was judged of a publisher's messages with the same edges; it holds for a time, while nothing changes.

    ``children`` are the planned edges that come with it, ``admitted`` the edges that may pass;
    None: all.
    """

    stamps: StampHistory = field(default_factory=StampHistory)
    epoch: int = -1
    until: float = 0.0
    cases: tuple[Case, ...] = ()
    children: tuple[str, ...] = ()
    admitted: frozenset[tuple[str, str]] | None = None


class Verdicts:
    """What was judged of each publisher's messages, by the rules of ownership, and what waits for a name."""

    def __init__(
        self, rules: OwnershipRules, senders: Senders, cases: Cases, start: Start
    ) -> None:
        self._rules = rules
        self._senders = senders
        self._cases = cases
        self._start = start
        self._verdicts: dict[tuple[bytes | None, bool, Edges], Verdict] = {}
        self._verdict_edges = 0
        self._pending: dict[SentEdge, float] = {}
        #: Publishers of more undeclared edges than are judged.
        self.flooders: dict[bytes | None, Flood] = {}

    @property
    def waits(self) -> bool:
        """Whether something waits for its sender's name."""
        return bool(self._pending)

    def take(self, message: Message, now: float) -> Verdict:
        """Return the verdict on a message."""
        key = (message.gid, message.static, message.edges)
        verdict = self._verdicts.get(key)
        if verdict is None:
            self._verdict_edges += len(message.edges)
            if len(self._verdicts) >= MOST_VERDICTS or self._verdict_edges > MOST_VERDICT_EDGES:
                self._verdicts.clear()
                self._verdict_edges = len(message.edges)
            verdict = self._verdicts[key] = Verdict()
        if verdict.epoch != self._rules.changes or now > verdict.until:
            self.judge(verdict, message, now)
        for case in verdict.cases:
            case.last = now
        return verdict

    def forget_stamps(self) -> None:
        """Take the next stamps as first ones: the clock has gone back."""
        for verdict in self._verdicts.values():
            verdict.stamps = StampHistory()

    def judge(self, verdict: Verdict, message: Message, now: float) -> None:
        """Judge the edges of a message whose sender has a name; the verdict holds if all is certain."""
        nodes = self._senders.nodes(message.gid, static=message.static)
        sure = self._senders.is_sure(message.gid)
        epoch, certain = self._rules.changes, sure
        cases, children, admitted = [], [], []
        strange = {child for _, child in message.edges} - self._rules.planned.keys()
        left = MOST_UNDECLARED - self._undeclared(message.gid) if strange else 0
        for parent, child in dict.fromkeys(message.edges):
            if child in strange and not self._rules.may_be_undeclared(parent, child):
                left -= 1
                if left < 0:
                    continue
            sent = SentEdge(message.gid, parent, child, message.static)
            violation = self._rules.violation(sent, nodes, now) if nodes else None
            # Where ids do not say whose they are, the sender may be one that the graph does not
            # show yet.
            if not nodes or (violation and not sure and not violation.namesake):
                self._pending.setdefault(sent, now)
                certain = False
                continue
            case, arrived = self._note(violation, sent, now)
            if case:
                cases.append(case)
                certain = certain and not case.violation.namesake
            else:
                admitted.append((parent, child))
            if arrived:
                children.append(child)
        verdict.admitted = None if {*admitted} == {*message.edges} else frozenset(admitted)
        verdict.cases, verdict.children = tuple(cases), tuple(children)
        if left < 0:
            if message.gid not in self.flooders:  # whose messages are counted from now on
                self.flooders[message.gid] = Flood(now)
                self.flooders[message.gid].count(len(message.edges), now)
            epoch = self._rules.changes
        verdict.epoch = epoch if certain and epoch == self._rules.changes else -1
        verdict.until = now + STRANGE_S if strange else float("inf")

    def _undeclared(self, gid: bytes | None) -> int:
        """Return how many undeclared edges of the publisher are known to be wrong, or wait for its name."""
        return self._cases.undeclared(gid) + sum(sent.gid == gid for sent in self._pending)

    def see_again(self, now: float) -> list[tuple[str, ...]]:
        """Judge what waited for a name, and return the planned edges that have come with it, by their senders."""
        arrived: dict[bytes | None, list[str]] = {}
        for sent, since in list(self._pending.items()):
            nodes = self._senders.nodes(sent.gid, static=sent.static)
            if (nodes and self._senders.is_sure(sent.gid)) or now - since >= self._patience_s(
                sent, nodes
            ):
                del self._pending[sent]
                if self._note(self._rules.violation(sent, nodes, now), sent, now)[1]:
                    arrived.setdefault(sent.gid, []).append(sent.child)
        return [tuple(children) for children in arrived.values()]

    def _patience_s(self, sent: SentEdge, nodes: tuple[str, ...]) -> float:
        """Return how long to wait for the sender's name. One that may be the owner is not blamed in a hurry."""
        if nodes:
            return NAMELESS_S
        edge = self._rules.planned.get(sent.child)
        if edge is None or not edge.may_hang_on(sent.parent):
            return NAMELESS_S
        owners = self._rules.owners
        known = owners.is_known(sent.child) and self._senders.is_present(
            owners.current(sent.child)
        )
        early = self._start.cleared is None and self._rules.started.get(edge.owner, False)
        return NAMELESS_S if known or early else NAMELESS_OWNER_S

    def _note(
        self, violation: Violation | None, sent: SentEdge, now: float
    ) -> tuple[Case | None, bool]:
        """Return the case that the violation is, if there is one, and whether the owner's edge has come."""
        case = self._cases.note(violation, sent.gid, now) if violation else None
        planned = sent.child in self._rules.planned
        # Of two that take turns either may be the owner; its edge is not silent.
        return case, planned and (
            violation is None or (violation.namesake and self._rules.owners.is_known(sent.child))
        )
