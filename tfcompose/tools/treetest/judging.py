"""Judgement of a case: each expectation is compared with the observed tree."""

from __future__ import annotations

import re
from dataclasses import dataclass
from math import inf
from typing import TYPE_CHECKING, TypeVar

from tfcompose.foundation.findings import Note, finding
from tfcompose.foundation.geometry import Offset
from tfcompose.foundation.numbers import numbers
from tfcompose.foundation.text import list_names, plural
from tfcompose.guard.verdict.ownership import may_be_owners, relays_of
from tfcompose.guard.verdict.publishers import SAME_POSE
from tfcompose.guard.verdict.verify import verify
from tfcompose.model.plan.topics import parts_of
from tfcompose.tf.bags import BagError, BagFeed
from tfcompose.tf.live.feed import follow
from tfcompose.tools.treetest.faults import RecordedFaults
from tfcompose.tools.treetest.golden import GoldenProbe, judge_likeness, read_golden
from tfcompose.tools.treetest.injections import split_pair
from tfcompose.tools.treetest.joints import (
    JointProbe,
    expected_motion,
    judge_declared_joint,
    judge_motion,
)
from tfcompose.tools.treetest.replay import (
    SECOND_NS,
    AgeProbe,
    LookupProbe,
    MessageLog,
    PoseProbe,
    Probe,
    ProbedTree,
    Timeline,
)

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from tfcompose.foundation.findings import Finding
    from tfcompose.foundation.signals import Stop
    from tfcompose.model.plan import PlanEdge
    from tfcompose.tf.live.edges import EdgeState, EdgeStream
    from tfcompose.tools.treetest.case import Case
    from tfcompose.tools.treetest.spec import EdgeExpectation, FindingExpectation

    Topics = tuple[str, str]

P = TypeVar("P", bound=Probe)


def judge_recording(case: Case, bag: str, stop: Stop, folder: Path | None) -> list[Finding]:
    """Return a finding for each expectation that the recording does not meet.

    With any, files about the tree are written to the folder.
    """
    judge = CaseJudge(case, keeps=folder is not None)
    faults = RecordedFaults(case.spec.inject, case.plan)
    try:
        follow(BagFeed(bag, judge.trees, faults.inject), stop)
    except BagError as error:
        return [finding("TF907", str(error), case.value_span("bag"), help=error.help)]
    findings = list(_late_faults(case, faults.length_ns / SECOND_NS) or judge.findings())
    if findings:
        judge.write_evidence(folder)
    return findings


def _late_faults(case: Case, length_s: float) -> list[Finding]:
    """Return a finding for each fault that would begin after the end of a recording."""
    return [
        finding(
            "TF932",
            f"{each.kind} would begin at {each.at:g} s; the recording ends after {length_s:.4g} s",
            case.value_span("inject", index, "at"),
            help="begin it earlier, or take a longer recording",
        )
        for index, each in enumerate(case.spec.inject)
        if each.at is not None and each.at > length_s
    ]


class CaseJudge:
    """The observed trees of a case, and their comparison with its expectations.

    ``window_s`` is the time over which rates, ages and findings are judged; 0: all of it.
    ``keeps``: the messages are kept for ``write_evidence``.
    """

    def __init__(self, case: Case, window_s: float = 0.0, *, keeps: bool = False) -> None:
        self.case = case
        self.timeline = Timeline()
        parts = parts_of(case.plan)
        self.trees = {topics: ProbedTree(self.timeline, window_s) for topics in parts}
        self._topics_of = {
            frame: topics
            for topics, part in parts.items()
            for edge in part.edges
            for frame in (edge.parent, edge.child)
        }
        self._ages: dict[str, AgeProbe] = {}
        self._joints: dict[str, JointProbe] = {}
        self._poses: dict[str, PoseProbe] = {}
        self._lookups: dict[tuple[int, int], LookupProbe] = {}
        #: By index of an expected finding: when it was first reported, after the first transform.
        self._reports: dict[int, float] = {}
        self._logs = {topics: MessageLog() for topics in parts if keeps}
        self._likenesses: list[GoldenProbe] = []
        self._golden_findings: list[Finding] = []
        self._add_probes()
        self._add_golden()

    def findings(self) -> Iterator[Finding]:
        """Yield the expectations that are not met."""
        yield from self.lasting_findings()
        yield from self.recent_findings()

    def lasting_findings(self) -> Iterator[Finding]:
        """Yield the unmet expectations that later messages do not meet."""
        expect = self.case.spec.expect
        if expect.complete is not None:
            yield from self._judge_completeness(expect.complete)
        for pair, pose in self._poses.items():
            yield from self._judge_pose(pair, pose)
        self._pass_time()
        for (index, position), lookup in self._lookups.items():
            yield from self._judge_lookup(index, position, lookup)
        for pair, joint in self._joints.items():
            yield from judge_motion(self.case, pair, joint)
        for pair, edge in expect.edges.items():
            yield from self._judge_declaration(pair, edge)
        for likeness in self._likenesses:
            yield from judge_likeness(self.case, likeness)
        yield from self._golden_findings

    def recent_findings(self) -> Iterator[Finding]:
        """Yield the unmet expectations of edges and findings, which later messages may meet."""
        expect = self.case.spec.expect
        for pair, edge in expect.edges.items():
            yield from self._judge_edge(pair, edge)
        if expect.findings is not None:
            yield from self._judge_findings(expect.findings)

    def begin_window(self) -> None:
        """Forget the ages so far."""
        for probe in self._ages.values():
            probe.most_s = None

    def missing_edges(self) -> list[str]:
        """Return the planned edges that have not arrived."""
        return [edge.name for edge in self.case.plan.edges if self._first_s(edge) is None]

    def elapsed_s(self) -> float | None:
        """Return the observed time since the first transform; None: none came."""
        if not self.timeline.begun_ns:
            return None
        return self.timeline.elapsed_s(max(tree.until_ns for tree in self.trees.values()))

    def are_lookups_decided(self) -> bool:
        """Return whether every lookup succeeded or is too late."""
        elapsed_s = self._pass_time()
        return all(lookup.is_decided(elapsed_s) for lookup in self._lookups.values())

    def _pass_time(self) -> float:
        """Tell the lookups the time since the first transform, and return it."""
        elapsed_s = self.elapsed_s() or 0.0
        for lookup in self._lookups.values():
            lookup.pass_time(elapsed_s)
        return elapsed_s

    def note_reports(self) -> bool:
        """Note the expected findings that are reported now; return whether each one was."""
        expected = self.case.spec.expect.findings or ()
        if len(self._reports) < len(expected):
            observed = self._observed_findings()
            for index, entry in enumerate(expected):
                if any(fits(entry, each) for each in observed):
                    self._reports.setdefault(index, self.elapsed_s() or 0.0)
        return len(self._reports) == len(expected)

    def late_reports(self, since_s: float) -> Iterator[Finding]:
        """Yield the expected findings that came later after a time than they may."""
        for index, reported_s in self._reports.items():
            entry = (self.case.spec.expect.findings or ())[index]
            if entry.within is not None and reported_s > since_s + entry.within:
                span = self.case.value_span("expect", "findings", index, "within")
                message = (
                    f"expected {entry.code} within {entry.within:g} s; it came after"
                    f" {reported_s - since_s:.3g} s"
                )
                yield finding("TF931", message, span)

    def write_evidence(self, folder: Path | None) -> None:
        """Write a bag and a picture of the trees into a folder, if their messages are kept.

        Raises:
            OSError: if they cannot be written.
        """
        if folder is not None and self._logs:
            from tfcompose.tools.treetest.evidence import (  # noqa: PLC0415 (loads rosbags)
                write_evidence,
            )

            write_evidence(folder, self.case, self.trees, self._logs)

    def _observed_findings(self) -> list[Finding]:
        verdicts = verify(self.case.plan, self.trees, SAME_POSE)
        return [each for verdict in verdicts for each in verdict.findings]

    def _add_probes(self) -> None:
        for topics, log in self._logs.items():
            self.trees[topics].probes.append(log)
        expect = self.case.spec.expect
        for pair, edge in expect.edges.items():
            child = split_pair(pair)[1]
            if edge.age is not None:
                self._ages[pair] = self._probe(child, AgeProbe(child))
            if edge.joint is not None:
                motion = expected_motion(edge.joint, self._planned(child))
                if motion is not None:
                    self._joints[pair] = self._probe(child, motion)
        for pair, pose in expect.pose.items():
            target, source = split_pair(pair)
            probe = PoseProbe(target, source, pose.xyz, pose.rotation, Offset(*pose.within))
            self._poses[pair] = self._probe(source, probe)
        for index, lookup in enumerate(expect.lookups):
            for position, at_s in enumerate(lookup.at):
                attempt = LookupProbe(lookup.from_, lookup.to, at_s, lookup.timeout)
                self._lookups[index, position] = self._probe(lookup.to, attempt)

    def _add_golden(self) -> None:
        """Add the probes for the golden recording, if the case has one."""
        if self.case.golden is None:
            return
        within = Offset(*self.case.spec.expect.within)
        try:
            golden = read_golden(self.case.golden, tuple(self.trees))
        except BagError as error:
            span = self.case.value_span("expect", "like")
            self._golden_findings.append(finding("TF907", str(error), span, help=error.help))
            return
        for topics, paths in golden.items():
            probe = GoldenProbe(paths, within)
            self._likenesses.append(probe)
            self.trees[topics].probes.append(probe)

    def _planned(self, child: str) -> PlanEdge:
        return next(edge for edge in self.case.plan.edges if edge.child == child)

    def _probe(self, frame: str, probe: P) -> P:
        self.trees[self._topics_of[frame]].probes.append(probe)
        return probe

    def _judge_completeness(self, within_s: float) -> Iterator[Finding]:
        firsts = {edge.name: self._first_s(edge) for edge in self.case.plan.edges}
        missing = [name for name, first_s in firsts.items() if first_s is None]
        late = {name: at for name, at in firsts.items() if at is not None and at > within_s}
        span = self.case.value_span("expect", "complete")
        if missing:
            message = f"expected all edges within {within_s:g} s; {list_names(missing)} never came"
            rejected = [
                edge.name
                for edge in self.case.plan.edges
                if edge.name in missing and any(self._streams_of(edge))
            ]
            notes = [Note(f"tf2 rejects every transform of {name}") for name in rejected]
            yield finding("TF931", message, span, notes=notes)
        if late:
            last = max(late, key=late.__getitem__)
            message = (
                f"expected all edges within {within_s:g} s; {last} came at {late[last]:.3f} s"
            )
            earlier = [f"{name} came at {at:.3f} s" for name, at in late.items() if name != last]
            yield finding("TF931", message, span, notes=map(Note, earlier))

    def _first_s(self, edge: PlanEdge) -> float | None:
        """Return when an edge of which tf2 accepts a transform first arrived; None: never."""
        first_ns = [stream.first_ns for stream in self._streams_of(edge) if stream.is_taken]
        return self.timeline.elapsed_s(min(first_ns)) if first_ns else None

    def _streams_of(self, edge: PlanEdge) -> Iterator[EdgeStream]:
        """Yield what arrived of a planned edge."""
        for stream in self.trees[self._topics_of[edge.child]].streams:
            if stream.child == edge.child and edge.may_hang_on(stream.parent):
                yield stream

    def _judge_declaration(self, pair: str, expected: EdgeExpectation) -> Iterator[Finding]:
        """Judge the rate and the joint of an edge by the robot file."""
        planned = self._planned(split_pair(pair)[1])
        low, high = expected.rate or (0.0, inf)
        if planned.rate is not None and not low <= planned.rate <= high:
            span = self.case.value_span("expect", "edges", pair, "rate")
            message = (
                f"{pair}: expected {low:g} to {high:g} Hz; the robot file declares"
                f" {planned.rate:g} Hz"
            )
            yield finding("TF931", message, span)
        if expected.joint is not None:
            yield from judge_declared_joint(self.case, pair, expected.joint, planned)

    def _judge_edge(self, pair: str, expected: EdgeExpectation) -> Iterator[Finding]:
        parent, child = split_pair(pair)
        at = ("expect", "edges", pair)
        planned = self._planned(child)
        if expected.owner not in {None, planned.owner}:
            message = f"{pair}: expected owner {expected.owner}; {planned.owner} owns it"
            yield finding("TF931", message, self.case.value_span(*at, "owner"))
        elif expected.owner is not None:
            yield from self._judge_senders(pair, planned)
        state = self._state(parent, child)
        if state is None or not state.stream.is_taken:
            reason = "it never came" if state is None else "tf2 rejects every transform of it"
            yield finding("TF931", f"{pair}: expected the edge; {reason}", self.case.span(*at))
            return
        if expected.rate is not None:
            yield from self._judge_rate(pair, expected.rate, state)
        probe = self._ages.get(pair)
        if probe is not None and expected.age is not None:
            yield from self._judge_age(pair, expected.age, probe)

    def _judge_senders(self, pair: str, planned: PlanEdge) -> Iterator[Finding]:
        """Judge who publishes the edge; a recording does not say."""
        relays = relays_of(self.case.plan)
        for state in self._states(*split_pair(pair)):
            if state.nodes and not may_be_owners(planned, state.nodes, relays):
                first_s = self.timeline.elapsed_s(state.stream.first_ns)
                message = (
                    f"{pair}: expected owner {planned.owner}; {state.publisher} publishes it,"
                    f" since {first_s:.3f} s"
                )
                span = self.case.value_span("expect", "edges", pair, "owner")
                yield finding("TF931", message, span)

    def _states(self, parent: str, child: str) -> list[EdgeState]:
        """Return the state of an edge from each of its publishers."""
        tree = self.trees[self._topics_of[child]]
        return [
            state
            for state in tree.edges(tree.until_ns)
            if (state.parent, state.child) == (parent, child)
        ]

    def _state(self, parent: str, child: str) -> EdgeState | None:
        """Return the newest state of an edge; None: it never arrived."""
        states = self._states(parent, child)
        return max(states, key=lambda state: state.stream.arrivals.last_ns, default=None)

    def _judge_rate(
        self, pair: str, expected: tuple[float, float], state: EdgeState
    ) -> Iterator[Finding]:
        low, high = expected
        timing = state.timing
        span = self.case.value_span("expect", "edges", pair, "rate")
        if timing.rate is None:
            messages = plural(state.stream.arrivals.count, "message")
            message = f"{pair}: expected {low:g} to {high:g} Hz; {messages} came"
            yield finding("TF931", message, span)
        elif not low <= timing.rate <= high:
            message = f"{pair}: expected {low:g} to {high:g} Hz; observed {timing.rate:.4g} Hz"
            yield finding("TF931", message, span, notes=self._gap_notes(state))

    def _gap_notes(self, state: EdgeState) -> Iterator[Note]:
        tree = self.trees[self._topics_of[state.child]]
        end_s, last_s = (
            self.timeline.elapsed_s(time_ns)
            for time_ns in (tree.until_ns, state.stream.arrivals.last_ns)
        )
        gap_s, since_s = state.timing.longest_gap_s, state.timing.since_gap_s
        if gap_s is not None and since_s is not None:
            yield Note(f"the longest gap is {gap_s:.3g} s and ends at {end_s - since_s:.3f} s")
        yield Note(
            f"the last message came at {last_s:.3f} s; the observation ends at {end_s:.3f} s"
        )

    def _judge_age(self, pair: str, expected_s: float, probe: AgeProbe) -> Iterator[Finding]:
        span = self.case.value_span("expect", "edges", pair, "age")
        limit = f"expected stamps at most {expected_s * 1e3:g} ms old"
        if probe.most_s is None:
            yield finding("TF931", f"{pair}: {limit}; no stamp came on /tf", span)
        elif probe.most_s > expected_s:
            message = (
                f"{pair}: {limit}; the one that came at {probe.elapsed_s:.3f} s was"
                f" {probe.most_s * 1e3:.4g} ms old"
            )
            yield finding("TF931", message, span)

    def _judge_pose(self, pair: str, probe: PoseProbe) -> Iterator[Finding]:
        span = self.case.span("expect", "pose", pair)
        if probe.worst is None:
            message = f"{pair}: expected a pose; {probe.failure}"
            yield finding("TF931", message, span)
        elif probe.beyond_s is not None:
            xyz, quat = (numbers(part) for part in (probe.worst.xyz, probe.worst.quat_xyzw))
            message = (
                f"{pair}: expected the pose within {probe.within.text}; off by"
                f" {probe.offset.text} at {probe.elapsed_s:.3f} s"
            )
            notes = [
                Note(f"it was xyz {xyz}, quat_xyzw {quat}"),
                Note(f"it was first off at {probe.beyond_s:.3f} s"),
            ]
            yield finding("TF931", message, span, notes=notes)

    def _judge_lookup(self, index: int, position: int, probe: LookupProbe) -> Iterator[Finding]:
        if probe.success_s is None:
            span = self.case.value_span("expect", "lookups", index, "at", position)
            message = (
                f"expected {probe.source} in {probe.target} at {probe.at_s:g} s; {probe.failure}"
            )
            yield finding("TF931", message, span)

    def _judge_findings(self, expected: tuple[FindingExpectation, ...]) -> Iterator[Finding]:
        observed = self._observed_findings()
        matched: set[int] = set()
        for index, entry in enumerate(expected):
            matches = {at for at, each in enumerate(observed) if fits(entry, each)}
            matched |= matches
            if not matches:
                span = self.case.value_span("expect", "findings", index)
                names = f" about {list_names(entry.names)}" if entry.names else ""
                message = f"expected {entry.code}{names}; verify does not report it"
                yield finding("TF931", message, span)
        for at, each in enumerate(observed):
            if at not in matched:
                message = f"expected no more findings; {each.label}: {each.message}"
                span = self.case.span("expect", "findings")
                yield finding("TF931", message, span, notes=each.notes)


def fits(expected: FindingExpectation, observed: Finding) -> bool:
    """Return whether a finding has the expected code, and mentions all names in full."""
    text = " ".join((observed.message, *(note.message for note in observed.notes)))
    return observed.code == expected.code and all(
        re.search(rf"(?<![\w/]){re.escape(name)}(?![\w/])", text) for name in expected.names
    )


@dataclass(frozen=True, slots=True)
class CaseResult:
    """Result of a case; no findings if it passed."""

    case: Case
    findings: tuple[Finding, ...]
    #: The folder with what a failed case left; None: nothing.
    folder: Path | None = None
