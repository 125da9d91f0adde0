"""What the guard reports, once: violations as cases, and publishers whose settings are wrong.

A violation is reported together with others of its kind and node, and said to be over when it has
ended.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from tfcompose.foundation.findings import Note
from tfcompose.guard.verdict.drivers import drives_of
from tfcompose.guard.verdict.ownership import (
    Violation,
    misnamed_help,
    other_robot_finding,
    sensor_of,
    taken_finding,
    violation_finding,
)
from tfcompose.guard.verdict.publishers import (
    best_effort_publisher,
    flood,
    leak,
    replaced_latched,
    unfenced,
    volatile_publisher,
)
from tfcompose.model.messages import Found, GuardEvent, Recovered, Taken, Unfenced
from tfcompose.model.plan.topics import GLOBAL
from tfcompose.tf.live.publishers import FEWEST_GAPS, NAMELESS_S, PARTICIPANT, UNCOUNTED

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping, Sequence

    from tfcompose.foundation.findings import Finding
    from tfcompose.guard.verdict.ownership import Start
    from tfcompose.model.plan import Plan, PlanEdge
    from tfcompose.tf.live.publishers import Publisher, Senders

#: For how long after the start a publisher can turn out to have been there first, and by how much
#: it must have been.
FIRST_S = 15.0
FIRST_BY_NS = 500_000_000
#: How long messages are waited for that tell from their count when a publisher began.
COUNTING_S = 0.7
#: A violation is over when its publisher has left and nothing came for so long, or for longer from
#: one that stays.
OVER_S = 3.0
OVER_WHILE_PRESENT_S = 30.0
#: Further edges of an offender that was just reported are collected for so long, and for longer
#: while more come and come: who names frames after what it tracks has new ones each second.
COLLECTED_S = 0.5
COLLECTED_AT_MOST_S = 60.0
#: Of so many publishers, and groups of cases, it is known that they were reported.
MOST_REPORTED = 2000
#: So long a flood is counted before it is reported, in seconds.
FLOOD_COUNTED_S = 1.0
#: So many edges have a line each when they are over; more are reported in one.
OVER_IN_LINES = 3
#: So long after it was first heard, an owner's latched message is surely all that is left of those
#: before, in seconds.
ALL_HEARD_S = 2.0
#: What a publisher can do before the start that keeps the plan from starting.
_TAKES = frozenset({"TF801", "TF802", "TF820"})
#: What becomes of it in a strict plan, by whether it is behind the fence.
_FATE = {
    True: "held back: no listener receives it",
    False: "not fenced off, so it cannot be held back: listeners receive it",
    None: "whether it is fenced off is unknown; if it is, it is held back",
}
#: So long a strict guard waits until it knows whether listeners get it, in seconds.
FATE_S = 0.3
#: Violations that ``stop-offender`` ends: who commits them breaks the tree.
_STOPPED_FOR = frozenset({"TF801", "TF802", "TF803", "TF820"})

#: So long what a publisher past the fence sends is waited for, so that it is reported before that
#: is stopped.
UNFENCED_SILENT_S = 0.5
_UNFENCED = "TF852"

#: All that another robot publishes is one finding.
OTHER_ROBOT = "TF854"

#: Code, parent, child and publisher's id.
Key = tuple[str, str, str, bytes]
#: Code, node, and the plan's process that it is proven to be of, empty where none is.
Group = tuple[str, str, str]


@dataclass(slots=True)
class Case:
    """A violation by a publisher, observed first at ``since`` and last at ``last``, and whether it was ``reported``.

    ``named`` are the publishers that were named of a violation by several that alternate.
    """

    violation: Violation
    gid: bytes | None
    since: float
    last: float
    reported: bool = False
    named: frozenset[bytes] = frozenset()

    @property
    def edge(self) -> tuple[str, str]:
        """The edge."""
        return (self.violation.parent, self.violation.child)


class Cases:
    """All violations that are not over; ``changes`` counts the reports."""

    def __init__(self, plan: Plan, senders: Senders, start: Start) -> None:
        self.open: dict[Key, Case] = {}
        self.changes = 0
        self._plan = plan
        self._senders = senders
        self._start = start
        self._drives = drives_of(plan)
        self._reported: dict[tuple[Group, bool], tuple[float, float]] = {}
        self._ended: dict[Group, list[tuple[Violation, bool]]] = {}
        #: Edges of which some publishers have ended, and others go on, with where these ran.
        self._left: dict[Group, dict[tuple[str, str], list[str]]] = {}
        started = [
            process for process in plan.processes if process.kind not in {"external", "guard"}
        ]
        self._started = {process.name for process in started}
        self._nodes = {node for process in started for node in process.nodes}

    def note(self, violation: Violation, gid: bytes | None, now: float) -> Case:
        """Note that the violation is observed now."""
        key = self._key(violation, gid)
        case = self.open.setdefault(key, Case(violation, gid, now, now))
        case.gid, case.last = gid, now
        if violation.nodes and not case.violation.nodes:  # what was blamed on nobody has a name
            case.violation, case.reported = violation, False
        return case

    def _key(self, violation: Violation, gid: bytes | None) -> Key:
        """Return what the case is known by: its publisher, unless several may have done it."""
        is_sure = self._senders.is_sure(gid) and not violation.alternates
        key = gid if gid is not None and is_sure else b""
        return (violation.code, violation.parent, violation.child, key)

    def undeclared(self, gid: bytes | None) -> int:
        """Return how many cases there are about edges of a publisher that nobody declared."""
        return sum(case.gid == gid and case.violation.edge is None for case in self.open.values())

    @property
    def unreported(self) -> bool:
        """Whether there is something that was not reported yet."""
        return not all(case.reported for case in self.open.values())

    def report(self, now: float, *, at_once: bytes | None = None) -> list[GuardEvent]:
        """Report new cases, those of one kind and node in one finding.

        With ``at_once`` they are that publisher's, also those of which more may come to be known.
        """
        grouped: dict[Group, list[Case]] = {}
        for case in self._ripe(now) if at_once is None else self._new(at_once):
            grouped.setdefault(self._group(case), []).append(case)
        events: list[GuardEvent] = []
        for group, cases in grouped.items():
            if not self._is_due((group, False), now):
                continue
            self.changes += 1
            if group[0] != OTHER_ROBOT or not self._is_reported(group[1], now, cases):
                events.append(self._event(cases, now))
            for case in cases:
                case.reported = True
        return events

    def _group(self, case: Case) -> Group:
        """Return with what a case is reported: its code and node, or the robot whose run the publisher is of."""
        run = self._senders.run(case.gid)
        if run:
            return (OTHER_ROBOT, run.name, "")
        return (case.violation.code, case.violation.who, self._senders.process(case.gid))

    def _publishers(self, cases: Sequence[Case]) -> list[bytes | None]:
        """Return who publishes the edges of these cases of one group now: an id of each process."""
        group, edges = self._group(cases[0]), {case.edge for case in cases}
        gids: list[bytes | None] = [
            gid
            for case in self.open.values()
            if case.edge in edges and self._group(case) == group
            for gid in self._gids_of(case)
        ]
        if not all(map(self._senders.is_sure, gids)):
            return [cases[0].gid]
        present = [gid for gid in gids if self._senders.is_present(gid)] or gids
        return list({self._process_of(gid): gid for gid in present}.values())

    def _process_of(self, gid: bytes | None) -> str | bytes:
        """Return what tells the publisher's process from others."""
        return self._senders.where(gid) or (gid or b"")[:PARTICIPANT]

    def _gids_of(self, case: Case) -> list[bytes | None]:
        """Return the publishers of a case: one, or all of the name, of which any may be the owner."""
        violation = case.violation
        if not violation.alternates or not self._senders.is_sure(case.gid):
            return [case.gid]
        return [*self._senders.named(violation.nodes, static=violation.static)] or [case.gid]

    def _is_reported(self, robot: str, now: float, cases: list[Case]) -> bool:
        """Return whether it was reported that the robot runs here, with edges that are as wrong as these."""
        severe = any(case.violation.edge for case in cases) or any(
            self._was_first(case, now) for case in cases
        )
        known = [
            one
            for one in self.open.values()
            if one.reported and self._group(one) == (OTHER_ROBOT, robot, "")
        ]
        return any(not severe or one.violation.edge for one in known)

    def _new(self, gid: bytes) -> Iterator[Case]:
        """Yield the cases of a publisher that were not reported."""
        yield from [case for case in self.open.values() if case.gid == gid and not case.reported]

    def _ripe(self, now: float) -> Iterator[Case]:
        """Yield the cases to report: those of which nothing more comes to be known.

        Where ids do not say whose they are, whoever takes turns with the owner may not be in the
        graph yet; all that it shows a while later are named.
        """
        for case in self.open.values():
            if (
                case.reported
                or self._may_learn_more(case.gid, now)
                or self._may_see_fate(case, now)
            ):
                continue
            if (
                case.violation.namesake
                and case.gid is not None
                and not self._senders.is_sure(case.gid)
            ):
                if now - case.since < NAMELESS_S:
                    continue
                nodes = self._senders.nodes(case.gid, static=case.violation.static)
                case.violation = replace(case.violation, nodes=nodes or case.violation.nodes)
            yield case

    def _is_due(self, group: tuple[Group, bool], now: float) -> bool:
        """Return whether the group, or its end, is reported now, and note it.

        The more often it is, the longer others wait.
        """
        at, collected_s = self._reported.get(group, (-COLLECTED_AT_MOST_S, 0.0))
        if now - at < collected_s:
            return False
        goes_on = self._start.cleared is not None and now - at < 2 * collected_s
        self._reported.pop(group, None)  # the newest comes last
        self._reported[group] = (
            now,
            min(2 * collected_s, COLLECTED_AT_MOST_S) if goes_on else COLLECTED_S,
        )
        if len(self._reported) > MOST_REPORTED:
            del self._reported[next(iter(self._reported))]
        return True

    def _event(self, cases: list[Case], now: float) -> Found | Taken:
        run, publishers = self._senders.run(cases[0].gid), self._publishers(cases)
        runs = [self._senders.where(gid) for gid in publishers]
        ours = self._senders.process(cases[0].gid)
        is_stranger = any(runs) and not ours
        violations = [replace(case.violation, stranger=is_stranger) for case in cases]
        for case in cases:
            if case.violation.alternates:
                case.named = frozenset(gid for gid in self._gids_of(case) if gid)
        if any(self._was_first(case, now) for case in cases):
            found = (
                other_robot_finding(violations, run, self._plan)
                if run
                else taken_finding(violations, runs)
            )
            return Taken(found)
        if run:
            return Found(other_robot_finding(violations, run, self._plan))
        driven = sensor_of(violations[0], self._drives)
        found = violation_finding(violations, self._plan, runs, driven)
        if advice := misnamed_help(violations, self._plan, ours):
            found = replace(found, help=advice)
        if self._says_fate(violations[0]):
            fates = dict.fromkeys(map(self._senders.is_held_back, publishers))
            found = replace(found, notes=(*found.notes, *(Note(_FATE[fate]) for fate in fates)))
        process = self._process(violations[0], cases[0].gid)
        if not process and self._may_be_ours(violations[0]):
            found = replace(
                found,
                notes=(
                    *found.notes,
                    Note("it is not proven which process did it: none is stopped"),
                ),
            )
        return Found(found, process)

    def _process(self, violation: Violation, gid: bytes | None) -> str:
        """Return the plan's process that is proven to have done it, where it can be stopped for it."""
        process = self._senders.process(gid) if violation.code in _STOPPED_FOR else ""
        return process if process in self._started else ""

    def _may_be_ours(self, violation: Violation) -> bool:
        """Return whether somebody would be stopped for it, if it were proven to be a process of this run."""
        is_policy = (
            self._plan.guard.on_violation == "stop-offender" and violation.code in _STOPPED_FOR
        )
        return is_policy and not self._nodes.isdisjoint(violation.nodes)

    def _says_fate(self, violation: Violation) -> bool:
        return self._plan.guard.mode == "strict" and not violation.is_of_stamps

    def _may_see_fate(self, case: Case, now: float) -> bool:
        """Whether it may be seen soon if listeners get what was sent."""
        is_open = self._says_fate(case.violation) and self._senders.is_held_back(case.gid) is None
        return is_open and now - case.since < FATE_S

    def _may_learn_more(self, gid: bytes | None, now: float) -> bool:
        """Whether more messages of this publisher can tell if it was there before the start."""
        sender, cleared = self._senders.sender(gid), self._start.cleared
        if sender is None or cleared is None or now - cleared > FIRST_S:
            return False
        began_before = sender.began_before(self._start.cleared_ns - FIRST_BY_NS)
        return began_before is None and now - sender.first_received < COUNTING_S

    def _was_first(self, case: Case, now: float) -> bool:
        """Whether the offender had the edge before the plan was started."""
        if case.violation.code not in _TAKES:
            return False
        cleared = self._start.cleared
        if cleared is None:
            return True
        sender = self._senders.sender(case.gid)
        if sender is None or now - cleared >= FIRST_S:
            return False
        return bool(sender.began_before(self._start.cleared_ns - FIRST_BY_NS, FEWEST_GAPS))

    def memory(self) -> tuple[CaseMemory, ...]:
        """Return what was reported and is not over."""
        return tuple(CaseMemory.of(case) for case in self.open.values() if case.reported)

    def recall(self, memory: tuple[CaseMemory, ...], until: float) -> None:
        """Take these as reported by the guard before, and as going on ``until`` then at least."""
        planned = {edge.child: edge for edge in self._plan.edges}
        for one in memory:
            case = one.case(planned, until)
            self.open[self._key(case.violation, case.gid)] = case

    def over(self, now: float) -> list[GuardEvent]:
        """Forget violations that have ended, and report that; the next of their kind is a new case.

        An edge that others of the same name go on with is not over: these are reported again.
        """
        ended = [
            key for key, case in self.open.items() if case.reported and self._has_ended(case, now)
        ]
        self.changes += len(ended)
        cases = [self.open.pop(key) for key in ended]
        going_on = {
            (self._group(c), c.edge): c for c in self.open.values() if c.reported and cases
        }
        for case in cases:
            group, violation = self._group(case), case.violation
            if other := going_on.get((group, case.edge)):
                if group[0] != OTHER_ROBOT:
                    self._note_left(other, {case.gid}, set(self._publishers([other])))
                continue
            is_latched = violation.static and not violation.is_of_stamps
            kept = is_latched and not self._senders.was_held_back(case.gid)
            self._ended.setdefault(group, []).append((violation, kept))
        self._note_alternating()
        due = [group for group in self._ended if self._is_due((group, True), now)]
        over = [Recovered(text) for group in due for text in _over(group, self._ended.pop(group))]
        return [*over, *self._report_remaining(now)]

    def _note_alternating(self) -> None:
        """Note where others alternate than those that were named."""
        for case in self.open.values():
            if case.reported and case.violation.alternates:
                gids = frozenset(gid for gid in self._gids_of(case) if gid)
                if len(gids) > 1 and gids != case.named:
                    self._note_left(case, case.named, gids)
                    case.named = gids

    def _note_left(
        self, case: Case, before: Collection[bytes | None], gids: Collection[bytes | None]
    ) -> None:
        """Note that these publish the edge, and who did ``before``, where that is not the same."""
        processes = {self._process_of(gid) for gid in gids}
        ended = {self._process_of(gid): gid for gid in before}
        is_new = case.violation.alternates and not processes <= ended.keys()
        if is_new or not ended.keys() <= processes:
            runs = self._left.setdefault(self._group(case), {}).setdefault(case.edge, [])
            runs += [
                where
                for process, gid in ended.items()
                if process not in processes and (where := self._senders.where(gid))
            ]

    def _report_remaining(self, now: float) -> Iterator[GuardEvent]:
        """Report who still publishes edges of which some publishers have ended, or others are there now."""
        for group in [group for group in self._left if self._is_due((group, False), now)]:
            left = self._left.pop(group)
            rows = (c for c in self.open.values() if c.edge in left and self._group(c) == group)
            cases = list({case.edge: case for case in rows if case.reported}.values())
            if not cases:
                continue
            event = self._event(cases, now)
            who = cases[0].violation.who
            ended = dict.fromkeys(where for case in cases for where in left[case.edge])
            notes = [Note(f"{who} has ended, which ran {where}") for where in ended]
            found = replace(event.found, notes=(*event.found.notes, *notes))
            yield Found(found, event.process if isinstance(event, Found) else "")

    def _has_ended(self, case: Case, now: float) -> bool:
        violation = case.violation
        if violation.alternates and self._senders.is_sure(case.gid):
            is_alone = len(self._gids_of(case)) < 2  # noqa: PLR2004 (two)
            return now - case.last > (OVER_S if is_alone else OVER_WHILE_PRESENT_S)
        if self._senders.is_present(case.gid) and not violation.is_of_stamps:
            return not violation.static and now - case.last > OVER_WHILE_PRESENT_S
        return now - case.last > OVER_S

    def wrong(self) -> Iterator[Finding]:
        """Yield what was reported and is not over, as a finding for each edge and name."""
        edges = {(self._group(c), c.edge): c for c in self.open.values() if c.reported}
        for case in edges.values():
            runs = [self._senders.where(gid) for gid in self._publishers([case])]
            yield violation_finding([case.violation], self._plan, runs)


def _over(group: Group, ended: list[tuple[Violation, bool]]) -> list[str]:
    """Return in words that these of one group are over, each with whether listeners keep what was latched."""
    kept_by_edge: dict[tuple[str, str], tuple[Violation, bool]] = {}
    for one, kept in ended:
        edge = (one.parent, one.child)
        kept_by_edge[edge] = (one, kept or kept_by_edge.get(edge, (one, False))[1])
    ended = list(kept_by_edge.values())
    if group[0] == OTHER_ROBOT:
        kept = any(kept for _, kept in ended)
        return [ended[0][0].over(len(ended) - 1, kept=kept, who=group[1])]
    if len(ended) <= OVER_IN_LINES:
        return [one.over(kept=kept) for one, kept in ended]
    return [ended[0][0].over(len(ended) - 1, kept=any(kept for _, kept in ended))]


@dataclass(frozen=True, slots=True)
class CaseMemory:
    """What the next guard must know of a case that was reported; ``gid`` is the publisher's id in hexadecimal."""

    code: str
    parent: str
    child: str
    nodes: tuple[str, ...]
    static: bool
    is_planned: bool
    namesake: bool
    alternates: bool
    loop: tuple[str, ...]
    detail: str
    gid: str | None

    @classmethod
    def of(cls, case: Case) -> CaseMemory:
        """Return what must be known of the case."""
        one = case.violation
        what = (one.code, one.parent, one.child, one.nodes, one.static, one.edge is not None)
        how = (one.namesake, one.alternates, one.loop, one.detail)
        return cls(*what, *how, None if case.gid is None else case.gid.hex())

    def case(self, planned: dict[str, PlanEdge], last: float) -> Case:
        """Return the case, as going on until then at least."""
        edge = planned.get(self.child) if self.is_planned else None
        what = (self.code, self.parent, self.child, self.nodes, self.static)
        violation = Violation(
            *what, edge, self.namesake, self.loop, self.detail, alternates=self.alternates
        )
        return Case(
            violation,
            None if self.gid is None else bytes.fromhex(self.gid),
            last,
            last,
            reported=True,
        )


@dataclass(slots=True)
class Flood:
    """What a publisher of more undeclared edges than are judged has sent since then: messages, up to how long ones."""

    since: float
    last: float = 0.0
    messages: int = 0
    transforms: int = 0

    def count(self, transforms: int, now: float) -> None:
        """Count a message."""
        self.messages, self.last, self.transforms = (
            self.messages + 1,
            now,
            max(self.transforms, transforms),
        )

    @property
    def hertz(self) -> float | None:
        """How many messages came a second; None where that is not known."""
        took_s = self.last - self.since
        return (self.messages - 1) / took_s if self.messages > 1 and took_s > 0 else None


class PublisherReports:
    """Publishers whose QoS or topic keeps listeners from receiving all of their messages; each is reported once.

    That holds for as long as guards follow each other; ``changes`` counts what was reported.
    """

    def __init__(self, plan: Plan) -> None:
        self._plan = plan
        self._nodes = {node for process in plan.processes for node in process.nodes}
        self._reported: dict[tuple[str, bytes], None] = {}
        self._silent_since: dict[bytes, float] = {}

    @property
    def changes(self) -> int:
        """How much was reported."""
        return len(self._reported)

    def wrong_settings(self, publishers: Sequence[Publisher]) -> list[Found]:
        """Return the findings for those on the plan's topics whose quality of service no listener accepts."""
        return [
            found
            for one in publishers
            for wrong in self._wrong_settings(one)
            for found in self._once(one, wrong)
        ]

    def _wrong_settings(self, one: Publisher) -> Iterator[Finding]:
        if one.node is None:
            return
        topic = one.topic or GLOBAL[one.static]
        if one.static and not one.latched:
            owned = [
                edge.name
                for edge in self._plan.edges
                if edge.node == one.node and edge.kind == "static"
            ]
            yield volatile_publisher(one.node, topic, owned)
        if not one.reliable:
            yield best_effort_publisher(one.node, topic)

    def leaving_the_fence(
        self, publishers: Sequence[Publisher], senders: Senders, now: float
    ) -> list[Publisher]:
        """Return the run's own publishers that send past the fence, once something of theirs was judged.

        One that sends nothing for a while is returned then.
        """
        outside = [
            one
            for one in publishers
            if one.node
            and one.ours
            and one.process
            and one.fenced is False
            and not self._is_known(_UNFENCED, one)
        ]
        since = {one.gid: self._silent_since.get(one.gid, now) for one in outside}
        self._silent_since = since
        return [
            one
            for one in outside
            if senders.sender(one.gid) or now - since[one.gid] >= UNFENCED_SILENT_S
        ]

    def unfenced(self, one: Publisher, *, remapped: bool) -> list[Unfenced]:
        """Return the finding for one of these; the fence may be of remappings."""
        topic = one.topic or GLOBAL[one.static]
        found = unfenced(one.node or "", one.process, topic, one.profile, remapped=remapped)
        return [Unfenced(new.found, one.process) for new in self._once(one, found)]

    def floods(
        self, senders: Senders, flooders: dict[bytes | None, Flood], now: float
    ) -> list[Found]:
        """Return the findings for publishers of more undeclared edges than are judged; forget those that have left."""
        found = []
        for gid, one in list(flooders.items()):
            publisher = senders.known.get(gid) if gid is not None else None
            if publisher is None or not publisher.node or now - one.since < FLOOD_COUNTED_S:
                continue
            found += self._once(
                publisher, flood(publisher.node, publisher.where, one.transforms, one.hertz)
            )
            if not senders.is_present(gid):
                del flooders[gid]
        return found

    def leaks(self, publishers: Sequence[Publisher], topics: tuple[str, str]) -> list[Found]:
        """Return the findings for the plan's nodes on the global topics, while its own (moving, static) are others."""
        inside = f"/{self._plan.ros.namespace.strip('/')}/"
        return [
            found
            for one in publishers
            if one.node and (one.node in self._nodes or one.node.startswith(inside))
            for found in self._once(one, leak(one.node, GLOBAL[one.static], topics[one.static]))
        ]

    def replaced(
        self, senders: Senders, missing: Mapping[str, Sequence[str]], now: float
    ) -> list[Found]:
        """Return the findings for nodes that sent latched messages before they were first heard.

        ``missing`` are names of fixed edges that did not come, by the node, of which others came.
        """
        found = []
        for one in senders.present.values() if missing else ():
            edges, sender = missing.get(one.node or ""), senders.sender(one.gid)
            if not (one.node and one.static and edges and sender):
                continue
            first = sender.first_sequence
            if 1 < first < UNCOUNTED and now - sender.first_received >= ALL_HEARD_S:
                found += self._once(one, replaced_latched(one.node, first - 1, edges))
        return found

    def memory(self) -> tuple[tuple[str, str], ...]:
        """Return what was reported: codes, with publishers' ids in hexadecimal."""
        return tuple(sorted((code, gid.hex()) for code, gid in self._reported))

    def recall(self, memory: tuple[tuple[str, str], ...]) -> None:
        """Take this as reported by the guard before."""
        self._reported = {(code, bytes.fromhex(gid)): None for code, gid in memory}

    def _is_known(self, code: str, one: Publisher) -> bool:
        return (code, one.gid) in self._reported

    def _once(self, one: Publisher, found: Finding) -> list[Found]:
        if self._is_known(found.code, one):
            return []
        self._reported[found.code, one.gid] = None
        if len(self._reported) > MOST_REPORTED:
            del self._reported[next(iter(self._reported))]
        return [Found(found)]
