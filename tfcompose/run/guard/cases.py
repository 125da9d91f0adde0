"""Offences as cases: each is told once, with others of its kind and node, and said to be over when it has ended."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from tfcompose.findings import Note
from tfcompose.ipc import Found, GuardEvent, Recovered, Taken
from tfcompose.run.guard.senders import FEWEST_GAPS, NAMELESS_S
from tfcompose.verdict.driven import drives_of, sensor_of
from tfcompose.verdict.offence import NAMELESS, Offence
from tfcompose.verdict.violation import misnamed, taken, violation

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.plan import Plan, PlanEdge
    from tfcompose.run.guard.senders import Senders

#: For how long after the start a publisher can turn out to have been there first, and by how much it must have been.
FIRST_S = 15.0
FIRST_BY_NS = 500_000_000
#: How long messages are waited for that tell from their count when a publisher began.
COUNTING_S = 0.7
#: An offence is over when its publisher has left and nothing came for so long, or for longer from one that stays.
OVER_S = 3.0
QUIET_S = 30.0
#: Further edges of an offender that was just reported are collected for so long, and for longer while more come and
#: come: who names frames after what it tracks has new ones each second.
COLLECTED_S = 0.5
COLLECTED_AT_MOST_S = 60.0
#: So many edges have a line each when they are over; more are told in one.
OVER_IN_LINES = 3
#: What a publisher can do before the start that keeps the plan from starting.
_TAKES = frozenset({"TF801", "TF802", "TF820"})
#: Offences that ``stop-offender`` ends: who commits them breaks the tree.
_STOPPED_FOR = frozenset({"TF801", "TF802", "TF803", "TF820"})

Key = tuple[str, str, str, str]
#: Code and node, and whether it is about the end.
Group = tuple[str, str, bool]


@dataclass(slots=True)
class Start:
    """When the look before the start began, and when it was over; in monotonic seconds, and by the system's clock."""

    begun: float
    begun_ns: int
    cleared: float | None = None
    cleared_ns: int = 0

    def clear(self, now: float) -> None:
        """Note that the look is over."""
        self.cleared = now
        self.cleared_ns = self.begun_ns + int((now - self.begun) * 1e9)


@dataclass(slots=True)
class Case:
    """An offence that was seen first at ``since`` and again at ``last``; ``told`` says whether it was reported."""

    offence: Offence
    gid: bytes | None
    since: float
    last: float
    told: bool = False


class Cases:
    """All that were seen and are not over; ``changes`` counts what was told."""

    def __init__(self, plan: Plan, senders: Senders, start: Start) -> None:
        self.open: dict[Key, Case] = {}
        self.changes = 0
        self._plan = plan
        self._senders = senders
        self._start = start
        self._drives = drives_of(plan)
        self._reported: dict[Group, tuple[float, float]] = {}
        self._ended: dict[Group, list[Offence]] = {}
        self._processes = {
            node: process.name for process in plan.processes if process.kind != "external" for node in process.nodes
        }

    def note(self, offence: Offence, gid: bytes | None, now: float) -> Case:
        """Note that the offence was seen now."""
        key = self._key(offence, gid)
        case = self.open.setdefault(key, Case(offence, gid, now, now))
        case.gid, case.last = gid, now
        if offence.nodes:  # what was blamed on nobody has a name now
            self.open.pop((offence.code, offence.parent, offence.child, NAMELESS), None)
        return case

    def _key(self, offence: Offence, gid: bytes | None) -> Key:
        """Return what the case is known by; where ids do not say whose, who may have done it changes all the time."""
        who = offence.who if self._senders.is_sure(gid) else ""
        return (offence.code, offence.parent, offence.child, who)

    @property
    def untold(self) -> bool:
        """Whether there is something that was not told yet."""
        return not all(case.told for case in self.open.values())

    def report(self, now: float) -> list[GuardEvent]:
        """Tell new cases, those of one kind and node in one finding."""
        grouped: dict[Group, list[Case]] = {}
        for case in self._ripe(now):
            grouped.setdefault((case.offence.code, case.offence.who, False), []).append(case)
        events: list[GuardEvent] = []
        for group, cases in grouped.items():
            if not self._is_due(group, now):
                continue
            self.changes += 1
            events.append(self._event(cases, now))
            for case in cases:
                case.told = True
        return events

    def _ripe(self, now: float) -> Iterator[Case]:
        """Yield the cases to tell: those of which nothing more comes to be known.

        Where ids do not say whose they are, whoever takes turns with the owner may not be in the graph yet; all that it
        shows a while later are named.
        """
        for case in self.open.values():
            if case.told or self._may_tell_more(case.gid, now):
                continue
            if case.offence.namesake and case.gid is not None and not self._senders.is_sure(case.gid):
                if now - case.since < NAMELESS_S:
                    continue
                nodes = self._senders.nodes(case.gid, static=case.offence.static)
                case.offence = replace(case.offence, nodes=nodes or case.offence.nodes)
            yield case

    def _is_due(self, group: Group, now: float) -> bool:
        """Return whether the group is told now, and note it: the more often it is, the longer the next ones wait."""
        at, collected_s = self._reported.get(group, (-COLLECTED_AT_MOST_S, 0.0))
        if now - at < collected_s:
            return False
        goes_on = self._start.cleared is not None and now - at < 2 * collected_s
        self._reported[group] = (now, min(2 * collected_s, COLLECTED_AT_MOST_S) if goes_on else COLLECTED_S)
        return True

    def _event(self, cases: list[Case], now: float) -> GuardEvent:
        offences = [case.offence for case in cases]
        where = self._senders.where(cases[0].gid)
        if any(self._was_first(case, now) for case in cases):
            return Taken(taken(offences, where))
        driven = sensor_of(offences[0], self._drives)
        found = violation(offences, self._plan, where, driven)
        if advice := misnamed(offences, self._plan, self._senders.process(cases[0].gid)):
            found = replace(found, help=advice)
        if self._plan.guard.mode == "strict" and not offences[0].of_stamps:
            found = replace(found, notes=(*found.notes, Note(_fate(held=self._senders.is_held_back(cases[0].gid)))))
        return Found(found, self._process(offences[0], cases[0].gid))

    def _process(self, offence: Offence, gid: bytes | None) -> str:
        """Return the plan's process that did it, where that is sure and it can be stopped for it."""
        if offence.namesake or len(offence.nodes) != 1 or offence.code not in _STOPPED_FOR:
            return ""
        return self._processes.get(offence.nodes[0], "") if self._senders.is_of_this_run(gid) else ""

    def _may_tell_more(self, gid: bytes | None, now: float) -> bool:
        """Whether more messages of this publisher can tell if it was there before the start."""
        sender, cleared = self._senders.sender(gid), self._start.cleared
        if sender is None or cleared is None or now - cleared > FIRST_S:
            return False
        began_before = sender.began_before(self._start.cleared_ns - FIRST_BY_NS)
        return began_before is None and now - sender.first_seen < COUNTING_S

    def _was_first(self, case: Case, now: float) -> bool:
        """Whether the offender had the edge before the plan was started."""
        if case.offence.code not in _TAKES:
            return False
        cleared = self._start.cleared
        if cleared is None:
            return True
        sender = self._senders.sender(case.gid)
        if sender is None or now - cleared >= FIRST_S:
            return False
        return bool(sender.began_before(self._start.cleared_ns - FIRST_BY_NS, FEWEST_GAPS))

    def memory(self) -> list[list[Any]]:
        """Return what was told and is not over, as values of JSON."""
        return [_to_json(case) for case in self.open.values() if case.told]

    def recall(self, memory: list[list[Any]], until: float) -> None:
        """Take these as told by the guard before, and as going on ``until`` then at least."""
        planned = {edge.child: edge for edge in self._plan.edges}
        for one in memory:
            case = _from_json(one, planned, until)
            self.open[self._key(case.offence, case.gid)] = case

    def over(self, now: float) -> list[GuardEvent]:
        """Forget offences that have ended, and say so; the next of their kind is a new case."""
        ended = [key for key, case in self.open.items() if case.told and self._has_ended(case, now)]
        self.changes += len(ended)
        for key in ended:
            one = self.open.pop(key).offence
            self._ended.setdefault((one.code, one.who, True), []).append(one)
        due = [group for group in self._ended if self._is_due(group, now)]
        return [Recovered(text) for group in due for text in _over(self._ended.pop(group))]

    def _has_ended(self, case: Case, now: float) -> bool:
        if self._senders.is_present(case.gid) and not case.offence.of_stamps:
            return not case.offence.static and now - case.last > QUIET_S
        return now - case.last > OVER_S


def _fate(*, held: bool) -> str:
    return (
        "held back: no listener gets it"
        if held
        else "not behind the fence, so it cannot be held back: listeners get it"
    )


def _over(ended: list[Offence]) -> list[str]:
    """Return in words that these of one kind and node are over."""
    if len(ended) <= OVER_IN_LINES:
        return [one.over() for one in ended]
    return [ended[0].over(len(ended) - 1)]


def _to_json(case: Case) -> list[Any]:
    one = case.offence
    gid = None if case.gid is None else case.gid.hex()
    what = (one.code, one.parent, one.child, list(one.nodes), one.static, one.edge is not None)
    return [*what, one.namesake, list(one.loop), one.detail, gid]


def _from_json(data: list[Any], planned: dict[str, PlanEdge], last: float) -> Case:
    code, parent, child, nodes, static, is_planned, namesake, loop, detail, gid = data
    edge = planned.get(child) if is_planned else None
    offence = Offence(code, parent, child, tuple(nodes), static, edge, namesake, tuple(loop), detail)
    return Case(offence, None if gid is None else bytes.fromhex(gid), last, last, told=True)
