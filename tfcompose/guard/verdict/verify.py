"""Compares a plan with a running tree or a recording, edge by edge.

Fixed poses are compared by value: poses that tfcompose publishes, poses on /tf_static from another
owner if the robot file states a pose. The pose of a moving joint is compared with the nearest one
that the joint allows. A driver may publish calibrated frames inside a sensor. These frames are
compared with the precision that the preset claims.

``verify`` returns a verdict for each edge. The doctor reports differences of the same kind and
publisher together.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

from tfcompose.foundation.findings import Finding, Note, did_you_mean
from tfcompose.foundation.geometry import Offset, Pose, offset_of
from tfcompose.foundation.text import list_names
from tfcompose.guard.verdict.consumers import late_stamps
from tfcompose.guard.verdict.drivers import (
    Expected,
    driver_pose_differs,
    drives_of,
    expected_frames,
    is_fixed,
    is_off,
)
from tfcompose.guard.verdict.faults import SELF, Fault, fault_finding, group_of, sensor_of
from tfcompose.guard.verdict.joints import find_sent_twice, planned_joints, unknown_joints
from tfcompose.guard.verdict.ownership import code_of, may_be_owners, relays_of
from tfcompose.guard.verdict.publishers import (
    SAME_POSE,
    find_floods,
    pose_differs,
    volatile_static,
)
from tfcompose.guard.verdict.rates import never_received_finding, owner_left, silent, slow
from tfcompose.guard.verdict.stamps import find_repeated_stamps, stamps_ahead, wrong_clock
from tfcompose.guard.verdict.tree import loop, rejected_transforms
from tfcompose.model.plan.stock import stand_ins
from tfcompose.model.plan.topics import parts_of
from tfcompose.tf.live.arrivals import KEPT_NS
from tfcompose.tf.live.state import TreeState

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from tfcompose.foundation.catalogue import Severity
    from tfcompose.foundation.findings import Span
    from tfcompose.model.plan import Plan, PlanEdge
    from tfcompose.tf.live.edges import EdgeState, TreeObserver

    Topics = tuple[str, str]
    Group = Sequence["Difference"]

#: Minimum number of messages to judge a rate.
FEWEST = 4
#: Time in seconds after which a publisher without a name is judged.
NAMELESS_S = 0.7
#: Maximum number of wrong poses that a finding lists.
MOST_POSES = 6


@dataclass(frozen=True, slots=True)
class Difference:
    """A deviation of an edge. Its code determines which of the later fields are set."""

    code: str
    #: The planned edge, None for an undeclared edge.
    edge: PlanEdge | None
    #: The observed edge, None for an edge that never arrived.
    live: EdgeState | None = None
    fault: Fault | None = None
    #: The frame of a preset whose pose the driver sends differently.
    driver: Expected | None = None
    #: Deviation of the pose from the plan, regardless of its sender.
    off: Offset | None = None
    #: Time without a message, in seconds.
    silence_s: float = 0.0
    #: Whether the silence has ended.
    over: bool = False


def differences(state: TreeState, plan: Plan, tolerance: Offset = SAME_POSE) -> list[Difference]:
    """Return the differences from the plan: planned edges in order, then undeclared edges."""
    comparison = _Comparison(state, plan, tolerance)
    planned = [
        difference for edge in plan.edges for difference in comparison.compare_planned(edge)
    ]
    return [*planned, *comparison.find_undeclared()]


@dataclass
class _Comparison:
    state: TreeState
    plan: Plan
    tolerance: Offset
    _relays: frozenset[str] = field(init=False)
    _stand_ins: dict[str, frozenset[str]] = field(init=False)

    def __post_init__(self) -> None:
        self._relays = relays_of(self.plan)
        present = {
            node for edge in self.state.edges if edge.present is not False for node in edge.nodes
        }
        stand_ins_by_child = stand_ins(self.plan)
        # Stock nodes that may send an edge if its owner is absent, by the edge's child.
        self._stand_ins = {
            edge.child: stand_ins_by_child[edge.child]
            for edge in self.plan.edges
            if edge.child in stand_ins_by_child and edge.node not in present
        }

    @cached_property
    def by_child(self) -> dict[str, list[EdgeState]]:
        states: dict[str, list[EdgeState]] = {}
        for edge in self.state.edges:
            states.setdefault(edge.child, []).append(edge)
        return states

    @cached_property
    def drivers(self) -> dict[str, Expected]:
        return expected_frames(self.plan)

    def compare_planned(self, edge: PlanEdge) -> Iterator[Difference]:
        some = self.by_child.get(edge.child, [])
        for observed in some:
            yield from self._fault(edge, observed)
            yield from self._value(edge, observed)
        yield from self._twice(edge, some)
        hanging = [observed for observed in some if observed.parent != edge.child]
        if not hanging:
            yield Difference("TF811", edge)
        owners = [
            observed
            for observed in hanging
            if edge.may_hang_on(observed.parent)
            and (not observed.nodes or self._may_own(edge, observed))
        ]
        if owners:  # for a restarted owner, the newest messages count
            newest = max(
                owners,
                key=lambda observed: (
                    observed.present is not False,
                    observed.stream.arrivals.last_ns,
                ),
            )
            yield from _times(edge, newest, simulated=self.plan.ros.clock == "sim")

    def find_undeclared(self) -> Iterator[Difference]:
        planned = {edge.child for edge in self.plan.edges}
        for edge in self.state.edges:
            stream = edge.stream
            if stream.child in planned or self.plan.allows_undeclared(stream.parent, stream.child):
                continue
            yield self._faulty("TF803", None, edge)

    def _fault(self, edge: PlanEdge, observed: EdgeState) -> Iterator[Difference]:
        stream = observed.stream
        if stream.parent == stream.child:
            yield self._faulty(SELF, edge, observed)
            return
        unknown = not observed.nodes and (self.state.recorded or observed.known_s < NAMELESS_S)
        owner, sure = unknown or self._may_own(edge, observed), unknown or len(observed.nodes) == 1
        code = code_of(edge, stream.parent, static=stream.static, owner=owner, sure=sure)
        if code:
            off = (
                self._off(edge, stream.pose)
                if code == "TF801" and stream.rejected_row is not stream.row
                else None
            )
            fault = self._faulty(code, edge, observed)
            yield (
                replace(fault, off=off)
                if off is not None and off.beyond(self.tolerance)
                else fault
            )

    def _faulty(
        self, code: str, edge: PlanEdge | None, observed: EdgeState, *, namesake: bool = False
    ) -> Difference:
        stream = observed.stream
        fault = Fault(
            code,
            stream.parent,
            stream.child,
            nodes=observed.nodes,
            static=stream.static,
            edge=edge,
            namesake=namesake,
            recorded=self.state.recorded,
        )
        return Difference(code, edge, observed, fault)

    def _twice(self, edge: PlanEdge, some: Sequence[EdgeState]) -> Iterator[Difference]:
        """Report several publishers with the owner's name."""
        namesakes: dict[bytes | None, EdgeState] = {}
        for observed in sorted(some, key=lambda observed: observed.stream.first_ns):
            if (
                observed.nodes == (edge.node,)
                and observed.present
                and edge.may_hang_on(observed.parent)
            ):
                namesakes.setdefault(observed.stream.gid, observed)
        of_kind = [
            namesake
            for namesake in namesakes.values()
            if namesake.stream.static == next(iter(namesakes.values())).stream.static
        ]
        for duplicate in of_kind[1:]:
            yield self._faulty("TF801", edge, duplicate, namesake=True)

    def _may_own(self, edge: PlanEdge, observed: EdgeState) -> bool:
        return may_be_owners(
            edge, observed.nodes, self._relays | self._stand_ins.get(edge.child, frozenset())
        )

    def _value(self, edge: PlanEdge, observed: EdgeState) -> Iterator[Difference]:
        stream = observed.stream
        if stream.rejected_row is stream.row or not edge.may_hang_on(stream.parent):
            return
        if observed.nodes and not self._may_own(edge, observed):
            return  # another finding reports a value from another node
        driver = self.drivers.get(edge.child)
        if driver is not None:
            if is_off(driver, stream.pose):
                yield Difference("TF828", edge, observed, driver=driver)
            return
        off = self._off(edge, stream.pose)
        if off is not None and off.beyond(self.tolerance):
            yield Difference("TF846", edge, observed, off=off)

    def _off(self, edge: PlanEdge, pose: Pose) -> Offset | None:
        """Return the deviation from the planned pose; None if only the owner knows the pose."""
        if edge.joint is None and not is_fixed(edge, self.plan.process(edge.owner)):
            return None
        return offset_of(edge.nearest_pose(pose), pose)


def _times(edge: PlanEdge, observed: EdgeState, *, simulated: bool) -> Iterator[Difference]:
    """Report an edge that does not arrive or arrives too rarely.

    A simulation may run slower than real time.
    """
    rate, limit_s = edge.rate, edge.silent_after_s
    if observed.present is False:
        yield Difference("TF804", edge, observed, silence_s=observed.age_s)
        return
    if observed.stream.static or rate is None or limit_s is None:
        return
    speed = min(1.0, observed.stream.speed) if simulated else 1.0
    limit_s /= speed
    gap_s, observed_rate = observed.timing.longest_gap_s, observed.timing.rate
    if observed.age_s > limit_s:
        yield Difference("TF804", edge, observed, silence_s=observed.age_s)
    elif gap_s is not None and gap_s > limit_s:
        yield Difference("TF804", edge, observed, silence_s=gap_s, over=True)
    elif (
        observed_rate is not None
        and observed.stream.arrivals.count >= FEWEST
        and edge.is_slow(observed_rate, speed)
    ):
        yield Difference("TF805", edge, observed)


def missing_help(state: TreeState, plan: Plan, edge: PlanEdge) -> str:
    """Return the help for an edge that never arrived."""
    planned = {edge.child for edge in plan.edges}
    strangers = [edge.child for edge in state.edges if edge.child not in planned]
    advice = did_you_mean(edge.child, strangers)
    if advice or state.recorded:
        return advice
    if edge.node in state.nodes:
        return (
            f"{edge.node} is running and sends nothing: what does it wait for, and is its TF"
            " switched on?"
        )
    kind = next((process.kind for process in plan.processes if process.name == edge.owner), "")
    if kind == "external":
        return (
            f"no node {edge.node} was found: start it, or correct node: of the process"
            f" {edge.owner}"
        )
    return f"no node {edge.node} was found: is the robot running? tfcompose ps"


# Differences as findings.


def group_differences(differences: Iterable[Difference]) -> list[list[Difference]]:
    """Return groups of differences to report together, ordered by their first members."""
    groups: dict[tuple[object, ...], list[Difference]] = {}
    for finding in differences:
        groups.setdefault(_key(finding), []).append(finding)
    return list(groups.values())


def group_finding(
    group: Group,
    state: TreeState,
    plan: Plan,
    span: Span | None = None,
    slow_is: Severity = "warning",
) -> Finding:
    """Return the finding for the differences of a group.

    ``span`` is the first edge's place in the robot file.
    """
    first = group[0]
    finding = (
        _fault_finding(group, state, plan, span)
        if first.fault
        else _difference_finding(group, state, plan, span, slow_is)
    )
    # Advice about running nodes is useless for a recording.
    return (
        replace(finding, help="")
        if state.recorded and first.code in {"TF804", "TF805", "TF846"}
        else finding
    )


def _difference_finding(
    group: Group, state: TreeState, plan: Plan, span: Span | None, slow_is: Severity
) -> Finding:
    first = group[0]
    edges = [difference.edge for difference in group if difference.edge is not None]
    if first.live is None:
        return never_received_finding(edges, missing_help(state, plan, edges[0]), span)
    stream = first.live.stream
    if first.driver is not None:
        off = [
            (difference.driver, difference.live.stream.pose)
            for difference in group
            if difference.driver is not None and difference.live is not None
        ]
        return driver_pose_differs(first.live.publisher, off, span)
    if first.off is not None:
        return _poses(group, span)
    if first.code == "TF805":
        return slow(
            edges,
            min(difference.live.timing.rate or 0.0 for difference in group if difference.live),
            span,
            slow_is,
        )
    if stream.static:
        return owner_left(edges, span)
    gone = first.live.present is False
    return silent(
        edges, max(difference.silence_s for difference in group), span, over=first.over, gone=gone
    )


def _key(difference: Difference) -> tuple[object, ...]:
    if difference.fault is not None:
        owner = difference.edge.owner if difference.edge else None
        return (
            difference.code,
            difference.fault.who,
            owner,
            difference.fault.static if difference.code == "TF809" else None,
        )
    if difference.edge is None:
        return (difference.code,)
    edge = difference.edge
    sensor = difference.driver.driven.sensor if difference.driver else None
    rate = edge.rate if difference.code in {"TF804", "TF805"} else None
    return (
        difference.code,
        edge.owner,
        rate,
        difference.over,
        sensor,
        difference.live.publisher if difference.off and difference.live else None,
    )


def _fault_finding(group: Group, state: TreeState, plan: Plan, span: Span | None) -> Finding:
    faults = [difference.fault for difference in group if difference.fault is not None]
    runs = dict.fromkeys(state.where(difference.live) for difference in group if difference.live)
    driven = sensor_of(faults[0], drives_of(plan))
    finding = fault_finding(group_of(faults, plan, list(runs), driven), span)
    finding = replace(finding, notes=(*finding.notes, *_elsewhere(group)))
    if not faults[0].namesake:
        return finding
    gids = {difference.live.stream.gid for difference in group if difference.live}
    namesakes = [
        publisher
        for publisher in state.publishers
        if publisher.node in faults[0].nodes and publisher.gid not in gids and publisher.where
    ]
    notes = [Note(f"{publisher.node} runs {publisher.where}") for publisher in namesakes]
    return replace(finding, notes=(*finding.notes, *dict.fromkeys(notes)))


def _elsewhere(group: Group) -> list[Note]:
    """Return notes about deviating poses from nodes other than the owner."""
    off = [
        (difference.fault, difference.off)
        for difference in group
        if difference.fault and difference.off
    ]
    notes = [
        Note(f"its pose of {what.child} in {what.parent} is off by {far.text}")
        for what, far in off[:MOST_POSES]
    ]
    return (
        [*notes, Note(f"and {len(off) - len(notes)} more are off")]
        if len(off) > len(notes)
        else notes
    )


def _poses(group: Group, span: Span | None) -> Finding:
    off = [
        (difference.edge, difference.live.parent, difference.live.stream.pose)
        for difference in group
        if difference.edge and difference.live
    ]
    publisher = group[0].live.publisher if group[0].live else ""
    return pose_differs(off, publisher, span)


# Comparison of a complete plan.


def differs_from_plan(state: TreeState) -> Iterator[Finding]:
    """The published tree differs from the plan."""
    if state.plan is None or not (state.edges or state.publishers):
        return  # no node publishes TF, which another finding reports
    differing = [
        difference for difference in differences(state, state.plan) if difference.code != SELF
    ]  # other checks find these for all edges
    for group in group_differences(differing):
        yield group_finding(group, state, state.plan)


@dataclass(frozen=True, slots=True)
class Verdict:
    """Result for an edge, without findings if the edge is as expected."""

    edge: str
    #: The owner, None for an undeclared edge; empty for a finding about the entire tree.
    owner: str | None
    findings: tuple[Finding, ...]


def verify(
    plan: Plan,
    observers: Mapping[Topics, TreeObserver],
    tolerance: Offset,
    places: Mapping[str, Span] | None = None,
) -> list[Verdict]:
    """Return a verdict for each planned edge, in order, then for each unplanned edge.

    ``places`` has the edges' places in the robot file, by child.
    """
    findings: dict[str, list[Finding]] = {edge.child: [] for edge in plan.edges}
    extra = []
    for topics, part in parts_of(plan).items():
        state = state_of(observers[topics], topics)
        for edge in state.edges:
            if edge.child in findings:
                findings[edge.child] += rejected_transforms(edge)
                findings[edge.child] += _wrong_times(edge, state, part)
        for difference in differences(state, part, tolerance):
            # The parts of a plan have different edges but the same processes. Look up processes in
            # the complete plan.
            span = (places or {}).get(difference.edge.child) if difference.edge else None
            reported = group_finding([difference], state, plan, span, slow_is="error")
            if difference.edge is None and difference.live is not None:
                extra.append(Verdict(difference.live.name, None, (reported,)))
            elif difference.edge is not None:
                findings[difference.edge.child].append(reported)
        # An edge whose owner switches its parent has one parent after the other, and closes no
        # loop.
        switched = {edge.child for edge in part.edges if edge.switched}
        lasting = tuple(edge for edge in state.edges if edge.child not in switched)
        in_all = (
            *find_floods(state),
            *loop(replace(state, edges=lasting)),
            *volatile_static(state),
        )
        extra += [Verdict(list_names(state.topics), "", (finding,)) for finding in in_all]
    sent = list(dict.fromkeys(joint for each in observers.values() for joint in each.sent_joints))
    of_joints = (*find_sent_twice(sent), *unknown_joints(sent, planned_joints(plan)))
    extra += [
        Verdict(list_names({each.topic for each in sent}), "", (finding,)) for finding in of_joints
    ]
    return [
        *(Verdict(edge.name, edge.owner, tuple(findings[edge.child])) for edge in plan.edges),
        *extra,
    ]


#: A listener's buffer keeps transforms for this time, in seconds. If a stamp is older on arrival,
#: its transform is dropped.
_KEPT_S = KEPT_NS / 1e9
#: Stamps that are farther ahead, in seconds, come from another clock, not from a node that
#: predicts.
_AHEAD_S = 1.0


def _wrong_times(edge: EdgeState, state: TreeState, plan: Plan) -> Iterator[Finding]:
    """Yield findings about stamps that make lookups at the current time fail.

    These are the doctor's checks. Whether simulated time advances is unknown here.
    """
    if plan.ros.clock == "sim":
        return
    alone = replace(state, edges=(edge,))
    yield from wrong_clock(alone)
    for finding in find_repeated_stamps(alone):
        yield replace(finding, severity="error")
    most_s = edge.timing.most_delay_s
    for finding in (*stamps_ahead(alone), *late_stamps(alone)):
        is_useless = most_s is not None and (most_s <= -_AHEAD_S or most_s >= _KEPT_S)
        yield replace(finding, severity="error") if is_useless else finding


def state_of(observer: TreeObserver, topics: Topics) -> TreeState:
    """Return the state that an observer has received on the topics (moving, fixed)."""
    return TreeState(
        max(0, observer.until_ns - observer.begun_ns) / 1e9,
        topics,
        tuple(observer.edges(observer.until_ns)),
        tuple(observer.publishers.by_gid.values()),
        observer.nodes,
        beyond=dict(observer.beyond),
        recorded=observer.recorded,
    )


def summary(verdicts: Sequence[Verdict]) -> str:
    """Return a line with the numbers of expected and undeclared edges."""
    planned = [verdict for verdict in verdicts if verdict.owner]
    right = sum(not verdict.findings for verdict in planned)
    extra = sum(verdict.owner is None for verdict in verdicts)
    more = f", {extra} not declared" if extra else ""
    return f"{right} of {len(planned)} edges as expected{more}"
