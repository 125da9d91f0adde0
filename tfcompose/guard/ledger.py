"""Ledger of edges: their publishers, faults and reports.

A message is judged once. The verdict is valid for the publisher's next messages with the same
edges until the ledger's ``epoch`` changes. It changes with the senders of a frame, the shape of
the tree, the start of the plan, or the end of a fault. A message from a publisher whose node name
is unknown waits for the name for a while.

A fault belongs to a publisher. Faults with the same code and node name are reported in a single
finding that names each process. If some of these faults end, the remaining faults are reported
again. When the last of them ends, their end is reported.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

from tfcompose.foundation.findings import Note
from tfcompose.guard.frames import Frames
from tfcompose.guard.reports import Flood, Pace
from tfcompose.guard.verdict import faults
from tfcompose.guard.verdict.drivers import drives_of
from tfcompose.guard.verdict.faults import Fault, fault_finding, group_of
from tfcompose.guard.verdict.ownership import code_of
from tfcompose.guard.verdict.stamps import StampHistory
from tfcompose.model.messages import EdgeTaken, FindingShown, RecoveredShown
from tfcompose.tf.live.publishers import NAMELESS_S, PARTICIPANT

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from tfcompose.foundation.findings import Finding
    from tfcompose.guard.before_start import StartTime
    from tfcompose.model.messages import GuardEvent
    from tfcompose.model.plan import Plan, PlanEdge
    from tfcompose.tf.live.publishers import Message, Senders

#: Time in seconds after which a possible owner without a name is judged.
NAMELESS_OWNER_S = 5.0
#: Maximum number of different messages whose verdicts are kept, and of their edges in total.
MOST_VERDICTS = 4096
MOST_VERDICT_EDGES = 200_000
#: Validity of the verdict on a message with undeclared edges, in seconds.
UNDECLARED_S = 1.0
#: Maximum number of undeclared edges of a publisher to judge. Further edges are neither reported
#: nor admitted.
MOST_UNDECLARED = 1000
#: A fault ends when its publisher has left and no message came for this time, in seconds. If the
#: publisher stays, the time is longer.
OVER_S = 3.0
OVER_WHILE_PRESENT_S = 30.0
#: Time in seconds for which a strict guard waits to find out whether listeners receive a message.
FATE_S = 0.3
#: Code of the single finding about all edges that another robot publishes.
OTHER_ROBOT = "TF854"

#: Faults that prevent the start of the plan if they are observed before it.
_TAKES = frozenset({faults.NOT_OWNER, faults.WRONG_PARENT, faults.LOOP})
#: Faults that break the tree. With ``stop-offender``, the guard has the process stopped.
_STOPPED_FOR = _TAKES | {faults.UNDECLARED}
#: Note about a message in a strict plan, by whether its sender is isolated.
_FATE = {
    True: "held back: no listener receives it",
    False: "not fenced off, so it cannot be held back: listeners receive it",
    None: "whether it is fenced off is unknown; if it is, it is held back",
}
#: tfcompose's publishers, which the launcher starts only once in a run.
_BUILT_IN = ("static", "joints")

#: Code, parent, child, and the publisher's id.
Key = tuple[str, str, str, bytes]
#: Code, node, and the plan's process that the publisher is proven to belong to.
Group = tuple[str, str, str]
#: An edge's parent and child.
Ends = tuple[str, str]


class SentEdge(NamedTuple):
    """An edge as a publisher sent it."""

    gid: bytes | None
    parent: str
    child: str
    static: bool


@dataclass(slots=True)
class OpenFault:
    """A fault of a publisher that has not ended."""

    fault: Fault
    gid: bytes | None
    #: Times of the first and last observation, in monotonic seconds.
    since: float
    last: float
    reported: bool = False
    #: Publishers that the report names; several publishers may alternate.
    named: frozenset[bytes | None] = frozenset()


@dataclass(slots=True)
class JudgedMessage:
    """The verdict on a publisher's messages with the same edges."""

    stamps: StampHistory = field(default_factory=StampHistory)
    epoch: int = -1
    #: End of the verdict's validity, in monotonic seconds.
    until: float = 0.0
    entries: tuple[OpenFault, ...] = ()
    #: Child frames of the planned edges in the message.
    children: tuple[str, ...] = ()
    #: Edges that may pass, None for all edges.
    admitted: frozenset[Ends] | None = None


class Ledger:
    """Received edges by publisher, compared with a plan.

    ``epoch`` changes whenever the ledger's knowledge changes.
    """

    def __init__(self, plan: Plan, senders: Senders, start: StartTime) -> None:
        self.epoch = 0
        self.planned: dict[str, PlanEdge] = {edge.child: edge for edge in plan.edges}
        self.frames = Frames(plan)
        self.entries: dict[Key, OpenFault] = {}
        #: Publishers with more undeclared edges than the judge accepts.
        self.flooders: dict[bytes | None, Flood] = {}
        self._plan = plan
        self._senders = senders
        self._start = start
        self._judged: dict[tuple[bytes | None, bool, tuple[Ends, ...]], JudgedMessage] = {}
        self._judged_edges = 0
        self._waiting: dict[SentEdge, float] = {}
        self._pace: Pace[tuple[Group, bool]] = Pace()
        self._ended: dict[Group, list[tuple[Fault, bool]]] = {}
        #: Locations of publishers that ended, by edges that other publishers of the group still
        #: send.
        self._left: dict[Group, dict[Ends, list[str]]] = {}
        self._know_processes(plan)

    def _know_processes(self, plan: Plan) -> None:
        self._drives = drives_of(plan)
        self._starts = {process.name: process.kind != "external" for process in plan.processes}
        offenders = [process for process in plan.managed if process.kind != "guard"]
        self._stoppable = {process.name for process in offenders}
        self._nodes = {node for process in offenders for node in process.nodes}

    def follow(self, plan: Plan) -> None:
        """Follow a plan that differs in lines and poses of edges, and in other processes."""
        self._plan = plan
        self._know_processes(plan)
        self.planned = {edge.child: edge for edge in plan.edges}
        for entry in self.entries.values():
            entry.fault = self._replan_fault(entry.fault)
        self.epoch += 1  # cached verdicts contain edges of the old plan

    # Messages.

    @property
    def is_settled(self) -> bool:
        """Whether no message waits for its sender's name and no fault waits for its report."""
        return not self._waiting and all(entry.reported for entry in self.entries.values())

    def take(self, message: Message, now: float) -> JudgedMessage:
        """Return the verdict on a message."""
        key = (message.gid, message.static, message.edges)
        judged = self._judged.get(key)
        if judged is None:
            self._judged_edges += len(message.edges)
            if len(self._judged) >= MOST_VERDICTS or self._judged_edges > MOST_VERDICT_EDGES:
                self._judged.clear()
                self._judged_edges = len(message.edges)
            judged = self._judged[key] = JudgedMessage()
        if judged.epoch != self.epoch or now > judged.until:
            self.judge(judged, message, now)
        for entry in judged.entries:
            entry.last = now
        return judged

    def judge(self, judged: JudgedMessage, message: Message, now: float) -> None:
        """Judge the edges of a message. A certain verdict is cached."""
        nodes = self._senders.nodes(message.gid, static=message.static)
        sure = self._senders.is_sure(message.gid)
        epoch, certain = self.epoch, sure
        entries, children, admitted = [], [], []
        unplanned = {child for _, child in message.edges} - self.planned.keys()
        left = MOST_UNDECLARED - self._count_undeclared(message.gid) if unplanned else 0
        for parent, child in dict.fromkeys(message.edges):
            if child in unplanned and not self._plan.allows_undeclared(parent, child):
                left -= 1
                if left < 0:
                    continue
            sent = SentEdge(message.gid, parent, child, message.static)
            fault = self._fault(sent, nodes, now) if nodes else None
            # If ids do not identify nodes, the sender may be a node that the graph does not show
            # yet.
            if not nodes or (fault and not sure and not fault.namesake):
                self._waiting.setdefault(sent, now)
                certain = False
                continue
            if fault:
                entries.append(self.note(fault, message.gid, now))
                certain = certain and not fault.namesake
            else:
                admitted.append((parent, child))
            if self._has_arrived(sent, fault):
                children.append(child)
        judged.admitted = None if {*admitted} == {*message.edges} else frozenset(admitted)
        judged.entries, judged.children = tuple(entries), tuple(children)
        if left < 0 and message.gid not in self.flooders:  # count its messages from now on
            self.count_flood(message.gid, len(message.edges), now)
        # The edges of a flood change the state, but need no new judgement.
        epoch = self.epoch if left < 0 else epoch
        judged.epoch = epoch if certain and epoch == self.epoch else -1
        judged.until = now + UNDECLARED_S if unplanned else float("inf")

    def recheck(self, now: float) -> list[tuple[str, ...]]:
        """Judge messages that waited for a name. Return their planned edges, by sender."""
        arrived: dict[bytes | None, list[str]] = {}
        for sent, since in list(self._waiting.items()):
            nodes = self._senders.nodes(sent.gid, static=sent.static)
            is_named = nodes and self._senders.is_sure(sent.gid)
            if not is_named and now - since < self._patience_s(sent, nodes):
                continue
            del self._waiting[sent]
            fault = self._fault(sent, nodes, now)
            if fault:
                self.note(fault, sent.gid, now)
            if self._has_arrived(sent, fault):
                arrived.setdefault(sent.gid, []).append(sent.child)
        return [tuple(children) for children in arrived.values()]

    def note(self, fault: Fault, gid: bytes | None, now: float) -> OpenFault:
        """Record that the fault is observed now."""
        entry = self.entries.setdefault(self._key(fault, gid), OpenFault(fault, gid, now, now))
        entry.gid, entry.last = gid, now
        if fault.nodes and not entry.fault.nodes:  # the publisher's name is now known
            entry.fault, entry.reported = fault, False
        return entry

    def count_flood(self, gid: bytes | None, transforms: int, now: float) -> None:
        """Count a message from a publisher with more undeclared edges than the judge accepts."""
        self.flooders.setdefault(gid, Flood(now)).count(transforms, now)

    def clear(self, now: float) -> None:
        """Record that the observation before the start is over."""
        self._start.clear(now)
        self.epoch += 1

    def forget_owners(self, edges: Iterable[PlanEdge]) -> None:
        """Treat the next sender of these edges as the first, because their owner was stopped."""
        for edge in edges:
            self.frames.forget_senders(edge.child)
        self.epoch += 1

    def forget_stamps(self) -> None:
        """Treat the next stamps as the first, because the clock has gone back."""
        for judged in self._judged.values():
            judged.stamps = StampHistory()

    def _key(self, fault: Fault, gid: bytes | None) -> Key:
        """Return the key of the fault.

        It contains the publisher if there is only one candidate.
        """
        is_sure = gid is not None and self._senders.is_sure(gid) and not fault.alternates
        return (fault.code, fault.parent, fault.child, (is_sure and gid) or b"")

    def _count_undeclared(self, gid: bytes | None) -> int:
        """Return the number of undeclared edges of the publisher.

        Edges count that are faults, and edges that wait for the publisher's name.
        """
        count = sum(e.gid == gid and e.fault.edge is None for e in self.entries.values())
        return count + sum(sent.gid == gid for sent in self._waiting)

    def _patience_s(self, sent: SentEdge, nodes: tuple[str, ...]) -> float:
        """Return the time to wait for the sender's name, longer for a possible owner."""
        edge = self.planned.get(sent.child)
        if nodes or edge is None or not edge.may_hang_on(sent.parent):
            return NAMELESS_S
        current = self.frames.current_sender(sent.child)
        is_known = current is not None and self._senders.is_present(current)
        is_early = self._start.cleared is None and self._starts.get(edge.owner, False)
        return NAMELESS_S if is_known or is_early else NAMELESS_OWNER_S

    def _has_arrived(self, sent: SentEdge, fault: Fault | None) -> bool:
        """Return whether the owner's edge has arrived.

        If publishers alternate, any of them may be the owner.
        """
        if sent.child not in self.planned or fault is None:
            return sent.child in self.planned
        return fault.namesake and self.frames.current_sender(sent.child) is not None

    # Rules.

    def _fault(self, sent: SentEdge, nodes: tuple[str, ...], now: float) -> Fault | None:
        """Return the fault of an edge that one of these nodes sent, or None."""
        gid, parent, child, static = sent
        edge = self.planned.get(child)
        if parent == child:
            return Fault(faults.SELF, parent, child, nodes=nodes, static=static, edge=edge)
        if edge is None:
            return self._fault_of_unplanned(sent, nodes, now)
        owner, sure = edge.node in nodes, len(nodes) == 1
        code = code_of(edge, parent, static=static, owner=owner, sure=sure)
        fault = Fault(code, parent, child, nodes=nodes, static=static, edge=edge)
        if code == faults.WRONG_PARENT and (loop := self.frames.loop(parent, child, now)):
            return replace(fault, code=faults.LOOP, loop=loop)
        if gid is not None and code in {"", faults.WRONG_TOPIC}:
            if self._is_namesake(edge, sent):
                return replace(fault, code=faults.NOT_OWNER, namesake=True)
            if self._is_alternating(edge, sent):
                return replace(fault, code=faults.NOT_OWNER, namesake=True, alternates=True)
        return fault if code else None

    def _fault_of_unplanned(
        self, sent: SentEdge, nodes: tuple[str, ...], now: float
    ) -> Fault | None:
        gid, parent, child, static = sent
        self.epoch += self.frames.attach(parent, child, now, static=static)
        is_undeclared = not self._plan.allows_undeclared(parent, child)
        loop = self.frames.loop(parent, child, now)
        is_ours = any(self.frames.is_planned(*edge) for edge in pairwise(loop))
        fault = Fault(faults.UNDECLARED, parent, child, nodes=nodes, static=static, edge=None)
        if loop and (is_ours or is_undeclared):
            return replace(fault, code=faults.LOOP, loop=loop)
        if is_undeclared:
            return fault
        if gid is None:
            return None
        current, alternates = self.frames.take_sender(child, gid)
        self.epoch += current != gid
        if not alternates or not self._senders.is_present(current):
            return None
        named = self._senders.nodes(current, static=static)
        detail = named[0] if len(named) == 1 else "another"
        return replace(fault, code=faults.TWO_PUBLISHERS, detail=detail)

    def _is_namesake(self, edge: PlanEdge, sent: SentEdge) -> bool:
        """Return whether a publisher has the owner's node name but certainly is not the owner.

        A process of this run proves its identity by its environment. If the plan starts the owner,
        no other process of the run can be the owner. While the owner is present, no process from
        elsewhere can be the owner. Without proof, a publisher is not the owner in two cases: it
        sent before the start, or the owner is one of tfcompose's publishers, which never restart,
        and is already present.
        """
        gid, sender, start = sent.gid, self._senders.sender(sent.gid), self._start
        if sender is None or not self._starts.get(edge.owner, False):
            return False
        proven = self._senders.process(gid)
        if proven != edge.owner:
            is_early = start.cleared is None or sender.first_ns < start.cleared_ns
            is_shown = self._senders.shows_process(edge.owner, edge.node, static=sent.static)
            if proven or is_early or (is_shown and self._senders.is_sure(gid)):
                return True
        current = self.frames.current_sender(edge.child)
        if edge.owner not in _BUILT_IN or current in {None, gid}:
            return False
        is_proven = bool(proven) and self._senders.process(current) != proven
        return self._senders.is_present(current) and not is_proven

    def _is_alternating(self, edge: PlanEdge, sent: SentEdge) -> bool:
        """Return whether publishers with the owner's name send the edge alternately: A, B, A.

        Each of them may be the owner, unless one of them has proven it. Fixed edges do not count,
        because they arrive again with every new subscription.
        """
        gid = sent.gid
        if gid is None or self._senders.sender(gid) is None:
            return False
        current, alternates = self.frames.take_sender(edge.child, gid)
        self.epoch += current != gid
        proven = self._senders.process(gid) if self._starts.get(edge.owner, False) else ""
        if proven and self._senders.process(current) != proven:
            return False
        return alternates and not sent.static

    # Findings.

    def report(self, now: float, *, at_once: bytes | None = None) -> list[GuardEvent]:
        """Report new faults. The faults of a group are reported in a single finding.

        ``at_once`` is a publisher whose faults are all reported now, even if more information
        about them may follow.
        """
        grouped: dict[Group, list[OpenFault]] = {}
        for entry in self.entries.values():
            if entry.reported:
                continue
            if self._is_ripe(entry, now) if at_once is None else entry.gid == at_once:
                grouped.setdefault(self._group(entry), []).append(entry)
        due = [group for group in grouped if self._is_due((group, False), now)]
        by_group = self._by_group() if due else {}
        events: list[GuardEvent] = []
        for group in due:
            entries, edges = grouped[group], by_group[group]
            self.epoch += 1
            if group[0] != OTHER_ROBOT or not self._is_known_robot(edges, entries, now):
                events.append(self._event(entries, edges, now))
            for entry in entries:
                entry.reported = True
        return events

    def over(self, now: float) -> list[GuardEvent]:
        """Remove ended faults and report their end. A later fault of the same kind is new.

        While other publishers with the same name send the edge, it is reported again instead.
        """
        ended = [
            key
            for key, entry in self.entries.items()
            if entry.reported and self._has_ended(entry, now)
        ]
        self.epoch += bool(ended)
        closed = [self.entries.pop(key) for key in ended]
        alternating = [
            entry
            for entry in self.entries.values()
            if entry.reported and entry.fault.alternates and now >= entry.since
        ]
        changed = [*closed, *alternating]
        by_group = self._by_group() if changed else {}
        for entry in changed:
            self._compare(entry, by_group.get(self._group(entry), {}))
        due = [group for group in self._ended if self._is_due((group, True), now)]
        texts = [text for group in due for text in self._over_texts(group)]
        return [*map(RecoveredShown, texts), *self._report_remaining(now)]

    def wrong(self) -> list[Finding]:
        """Return the open faults by edge and name, the worst first."""
        findings = []
        for edges in self._by_group().values():
            for entries in edges.values():
                if any(entry.reported for entry in entries):
                    runs = self._runs_of(self._publishers(entries))
                    group = group_of([entries[0].fault], self._plan, runs)
                    findings.append(fault_finding(group))
        return sorted(findings, key=lambda finding: (finding.severity, finding.code))

    def memory(self) -> dict[str, tuple[Fault, ...]]:
        """Return the open reported faults, by publisher id in hexadecimal."""
        reported: dict[str, tuple[Fault, ...]] = {}
        for entry in self.entries.values():
            if entry.reported:
                gid = entry.gid.hex() if entry.gid else ""
                reported[gid] = (*reported.get(gid, ()), entry.fault)
        return reported

    def recall(self, memory: Mapping[str, Sequence[Fault]], until: float) -> None:
        """Restore faults that the previous guard reported.

        They stay open at least ``until`` then.
        """
        for hexed, entries in memory.items():
            gid = bytes.fromhex(hexed) or None
            for fault in entries:
                entry = OpenFault(self._replan_fault(fault), gid, until, until, reported=True)
                self.entries[self._key(fault, gid)] = entry

    def _replan_fault(self, fault: Fault) -> Fault:
        """Return a fault that was found under another plan, with the edge of this plan."""
        return replace(fault, edge=self.planned.get(fault.child)) if fault.edge else fault

    def _group(self, entry: OpenFault) -> Group:
        """Return the group of a fault in reports: code and node name, or the node's robot."""
        if run := self._senders.run(entry.gid):
            return (OTHER_ROBOT, run.name, "")
        return (entry.fault.code, entry.fault.who, self._senders.process(entry.gid))

    def _by_group(self) -> dict[Group, dict[Ends, list[OpenFault]]]:
        """Return the faults by group and then by edge."""
        by_group: dict[Group, dict[Ends, list[OpenFault]]] = {}
        for entry in self.entries.values():
            edges = by_group.setdefault(self._group(entry), {})
            edges.setdefault(entry.fault.ends, []).append(entry)
        return by_group

    def _is_ripe(self, entry: OpenFault, now: float) -> bool:
        """Return whether no further information about the fault is expected.

        If ids do not identify nodes, a publisher that alternates with the owner may not be in the
        graph yet. In that case the report waits, and then names all candidates in the graph.
        """
        fault, gid = entry.fault, entry.gid
        sender = self._senders.sender(gid)
        if self._start.may_show_first(sender, now) or self._may_learn_fate(entry, now):
            return False
        if fault.namesake and gid is not None and not self._senders.is_sure(gid):
            if now - entry.since < NAMELESS_S:
                return False
            nodes = self._senders.nodes(gid, static=fault.static)
            entry.fault = replace(fault, nodes=nodes or fault.nodes)
        return True

    def _is_due(self, key: tuple[Group, bool], now: float) -> bool:
        return self._pace.is_due(key, now, grows=self._start.cleared is not None)

    def _event(
        self,
        entries: Sequence[OpenFault],
        edges: Mapping[Ends, Sequence[OpenFault]],
        now: float,
    ) -> FindingShown | EdgeTaken:
        """Return the event for faults of a group.

        ``edges`` are all its edges with their faults.
        """
        gid = entries[0].gid
        run, process = self._senders.run(gid), self._senders.process(gid)
        ends = dict.fromkeys(entry.fault.ends for entry in entries)
        publishers = self._publishers([entry for edge in ends for entry in edges[edge]])
        runs = self._runs_of(publishers)
        is_stranger = any(runs) and not process
        recorded = [replace(entry.fault, stranger=is_stranger) for entry in entries]
        for entry in entries:
            entry.named = frozenset(self._gids_of(entry))
        group = group_of(
            recorded, self._plan, runs, faults.sensor_of(recorded[0], self._drives), process
        )
        was_first = any(self._was_first(entry, now) for entry in entries)
        if run:
            finding = faults.other_robot_finding(recorded, run, self._plan)
            return EdgeTaken(finding) if was_first else FindingShown(finding)
        if was_first:
            return EdgeTaken(faults.taken_finding(group))
        finding, first = fault_finding(group), recorded[0]
        notes = []
        if self._says_fate(first):
            fates = dict.fromkeys(map(self._senders.is_held_back, publishers))
            notes += [Note(_FATE[fate]) for fate in fates]
        offender = process if process in self._stoppable and first.code in _STOPPED_FOR else ""
        if not offender and self._may_be_ours(first):
            notes += [Note("nothing is stopped: it is not certain which process did it")]
        return FindingShown(replace(finding, notes=(*finding.notes, *notes)), offender)

    def _report_remaining(self, now: float) -> Iterator[GuardEvent]:
        """Repeat reports of edges whose publishers have changed."""
        due = [group for group in self._left if self._is_due((group, False), now)]
        by_group = self._by_group() if due else {}
        for group in due:
            left, edges = self._left.pop(group), by_group.get(group, {})
            entries = [entry for ends in left for entry in edges.get(ends, ()) if entry.reported]
            if not entries:
                continue
            event = self._event(entries, edges, now)
            who = entries[0].fault.who
            ended = dict.fromkeys(where for entry in entries for where in left[entry.fault.ends])
            notes = [Note(f"{who} has ended; it ran {where}") for where in ended]
            finding = replace(event.found, notes=(*event.found.notes, *notes))
            yield FindingShown(finding, event.process if isinstance(event, FindingShown) else "")

    def _over_texts(self, group: Group) -> list[str]:
        robot = group[1] if group[0] == OTHER_ROBOT else ""
        return faults.over_texts(self._ended.pop(group), robot)

    def _compare(self, entry: OpenFault, edges: Mapping[Ends, Sequence[OpenFault]]) -> None:
        """Record that a fault has ended, or that its publishers have changed.

        The entry has ended or belongs to alternating publishers. ``edges`` are the edges of its
        group.
        """
        group, fault = self._group(entry), entry.fault
        reported = [open_fault for open_fault in edges.get(fault.ends, ()) if open_fault.reported]
        if not reported:
            is_latched = fault.static and not fault.is_of_stamps
            kept = is_latched and not self._senders.was_held_back(entry.gid)
            self._ended.setdefault(group, []).append((fault, kept))
            return
        sending = {self._process_of(gid) for gid in self._publishers(reported)}
        named = {self._process_of(gid): gid for gid in entry.named or self._gids_of(entry)}
        entry.named = frozenset(self._gids_of(entry))
        ended = [gid for process, gid in named.items() if process not in sending]
        is_joined = fault.alternates and not sending <= named.keys()
        is_alone = fault.alternates and len(sending) == 1
        if (ended or is_joined) and not is_alone and group[0] != OTHER_ROBOT:
            runs = self._left.setdefault(group, {}).setdefault(fault.ends, [])
            runs += filter(None, map(self._senders.where, ended))

    def _has_ended(self, entry: OpenFault, now: float) -> bool:
        fault, silent_s = entry.fault, now - entry.last
        if fault.alternates and self._senders.is_sure(entry.gid):
            is_alone = len(self._gids_of(entry)) == 1
            return silent_s > (OVER_S if is_alone else OVER_WHILE_PRESENT_S)
        if self._senders.is_present(entry.gid) and not fault.is_of_stamps:
            return not fault.static and silent_s > OVER_WHILE_PRESENT_S
        return silent_s > OVER_S

    # Publishers.

    def _publishers(self, entries: Sequence[OpenFault]) -> list[bytes | None]:
        """Return the present publishers of these entries, with a single id for each process.

        A process may have a publisher on each topic. If the pids are unknown, only publishers of
        the same edge on the same topic are certain to be different processes.
        """
        sent = [(gid, entry.fault) for entry in entries for gid in self._gids_of(entry)]
        if not all(self._senders.is_sure(gid) for gid, _ in sent):
            return [entries[0].gid]
        present = [(gid, fault) for gid, fault in sent if self._senders.is_present(gid)]
        located: dict[str, bytes | None] = {}
        by_edge: dict[tuple[Ends, bool], dict[str | bytes, bytes | None]] = {}
        for gid, fault in present or sent:
            if where := self._senders.where(gid):
                located[where] = gid
            else:
                processes = by_edge.setdefault((fault.ends, fault.static), {})
                processes[self._process_of(gid)] = gid
        most = max(by_edge.values(), key=len, default={})
        return [*located.values(), *most.values()]

    def _runs_of(self, publishers: Sequence[bytes | None]) -> list[str]:
        return [self._senders.where(gid) for gid in publishers]

    def _gids_of(self, entry: OpenFault) -> list[bytes | None]:
        """Return the publisher of a fault, or all alternating publishers."""
        fault = entry.fault
        if not fault.alternates or not self._senders.is_sure(entry.gid):
            return [entry.gid]
        return [*self._senders.publishers_of(fault.nodes, static=fault.static)] or [entry.gid]

    def _process_of(self, gid: bytes | None) -> str | bytes:
        """Return a value that identifies the publisher's process."""
        sender = self._senders.where(gid) or self._senders.process(gid)
        return sender or (gid or b"")[:PARTICIPANT]

    def _is_known_robot(
        self,
        edges: Mapping[Ends, Sequence[OpenFault]],
        entries: Sequence[OpenFault],
        now: float,
    ) -> bool:
        """Return whether a fault that is at least as severe was reported for the other robot."""
        is_severe = any(entry.fault.edge or self._was_first(entry, now) for entry in entries)
        recorded = [entry for sent in edges.values() for entry in sent if entry.reported]
        return any(not is_severe or entry.fault.edge for entry in recorded)

    def _may_be_ours(self, fault: Fault) -> bool:
        """Return whether the policy stops a process of this run that has the fault."""
        stops = self._plan.guard.on_violation == "stop-offender" and fault.code in _STOPPED_FOR
        return stops and not self._nodes.isdisjoint(fault.nodes)

    def _says_fate(self, fault: Fault) -> bool:
        return self._plan.guard.mode == "strict" and not fault.is_of_stamps

    def _may_learn_fate(self, entry: OpenFault, now: float) -> bool:
        """Return whether the guard will soon know if listeners receive the message."""
        is_open = self._says_fate(entry.fault) and self._senders.is_held_back(entry.gid) is None
        return is_open and now - entry.since < FATE_S

    def _was_first(self, entry: OpenFault, now: float) -> bool:
        """Return whether the publisher sent the edge before the plan was started."""
        sender = self._senders.sender(entry.gid)
        return entry.fault.code in _TAKES and self._start.was_first(sender, now)
