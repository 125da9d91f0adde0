"""Expected against seen: a plan's edges, and a census of a running tree or a bag.

What is fixed is compared by value: what tfcompose publishes itself, what another owner sends on /tf_static with a pose
that the robot says, and of a joint what its motion leaves as it is. Of frames inside a sensor that its driver publishes
only the presence counts: each unit is calibrated.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from tfcompose.diagnostic import Diagnostic, Note, Span, did_you_mean, finding
from tfcompose.plan import SLOW_BELOW
from tfcompose.pose import Pose
from tfcompose.verdict.offset import Offset, offset_of, shown

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from tfcompose.diagnostic import Severity
    from tfcompose.observe.census import Census, EdgeSeen
    from tfcompose.plan import Plan, PlanEdge

    Topics = tuple[str, str]

#: A rate is judged from so many messages on.
FEWEST = 4
_TURNING = frozenset({"revolute", "continuous"})


@dataclass(frozen=True, slots=True)
class Verdict:
    """What is wrong with an edge, nothing if all is as expected; ``owner`` is None where nobody declared it."""

    edge: str
    owner: str | None
    found: tuple[Diagnostic, ...]


def edges_by_topics(plan: Plan) -> dict[Topics, list[PlanEdge]]:
    """Return the edges by the topics (moving, fixed) that they are expected on, in the plan's order."""
    remaps = {process.name: process.remap for process in plan.processes}
    found: dict[Topics, list[PlanEdge]] = {}
    for edge in plan.edges:
        remap = remaps.get(edge.owner, {})
        found.setdefault((remap.get("/tf", "/tf"), remap.get("/tf_static", "/tf_static")), []).append(edge)
    return found


def verify(
    plan: Plan,
    censuses: Mapping[Topics, Census],
    now_ns: int,
    tolerance: Offset,
    places: Mapping[str, Span] | None = None,
) -> list[Verdict]:
    """Return a verdict for each planned edge, in the plan's order, then one for each edge that is not in the plan.

    ``now_ns`` is the time of the last look, by the clock of the arrivals; ``places`` is where the edges stand in the
    robot's file, by child.
    """
    verdicts = {}
    extra = []
    for topics, edges in edges_by_topics(plan).items():
        census = censuses[topics]
        expectations = _Expectations(plan, census, tolerance, places or {})
        seen: dict[str, list[EdgeSeen]] = {}
        for one in census.edges(now_ns):
            seen.setdefault(one.strand.child, []).append(one)
        planned = {edge.child for edge in edges}
        strangers = {child: some for child, some in seen.items() if child not in planned}
        for edge in edges:
            found = expectations.judge(edge, seen.get(edge.child, []), strangers)
            verdicts[edge.child] = Verdict(edge.name, edge.owner, tuple(found))
        extra += [one for some in strangers.values() for one in expectations.undeclared(some)]
    return [*(verdicts[edge.child] for edge in plan.edges), *extra]


@dataclass(frozen=True, slots=True)
class _Expectations:
    plan: Plan
    census: Census
    tolerance: Offset
    places: Mapping[str, Span]

    def judge(
        self, edge: PlanEdge, seen: Sequence[EdgeSeen], strangers: Mapping[str, Sequence[EdgeSeen]]
    ) -> Iterator[Diagnostic]:
        """Yield what is wrong with a planned edge."""
        if not seen:
            yield self._missing(edge, strangers)
            return
        rightly = [one for one in seen if edge.may_hang_on(one.strand.parent)]
        for one in seen:
            if one not in rightly:
                message = f"{edge.child} was seen in {_from(one)}, and belongs in {edge.parent}"
                yield self._finding("TF802", edge, message, "tf2 keeps the parent of the newest message")
        for one in rightly:
            yield from self._sent_rightly(edge, one)
            yield from self._value(edge, one)
        owners = [one for one in rightly if not one.nodes or self._is_owners(edge, one)]
        if owners:  # one that was started again is judged by what came last
            yield from self._times(
                edge, max(owners, key=lambda one: (one.present is not False, one.strand.tally.last_ns))
            )
        yield from self._several(edge, rightly)

    def undeclared(self, seen: Sequence[EdgeSeen]) -> Iterator[Verdict]:
        """Yield a verdict for an edge that is not in the plan, unless it may be there."""
        for one in seen:
            parent, child = one.strand.parent, one.strand.child
            if self.plan.may_be_undeclared(parent, child):
                continue
            severity: Severity = "error" if self.plan.guard.unknown_edges == "error" else "warning"
            advice = f"declare it under frames, or allow it: guard: {{allow: [{{parent: {parent}, child: {child}}}]}}"
            who = f" from {one.publisher}" if one.publisher else ""
            message = f"{one.name} was seen{who}, and nobody declared it"
            yield Verdict(one.name, None, (finding("TF803", message, None, help=advice, severity=severity),))

    def _is_owners(self, edge: PlanEdge, one: EdgeSeen) -> bool:
        """Whether the owner may have sent it: itself, or through a strict guard, which passes on what it owns."""
        guards = (node for process in self.plan.processes if process.kind == "guard" for node in process.nodes)
        return edge.node in one.nodes or any(node in one.nodes for node in guards)

    def _finding(self, code: str, edge: PlanEdge, message: str, advice: str = "") -> Diagnostic:
        place = self.places.get(edge.child)
        notes = [] if place else [Note(f"declared in {edge.source[0]}:{edge.source[1]}")]
        return finding(code, message, place, help=advice, notes=notes)

    def _missing(self, edge: PlanEdge, strangers: Mapping[str, Sequence[EdgeSeen]]) -> Diagnostic:
        message = f"{edge.name} was never seen; its owner is {edge.owner} ({edge.node})"
        advice = did_you_mean(edge.child, strangers)
        if not advice and self.census.present is not None:
            nodes = {each.node for each in self.census.publishers.values()}
            there = edge.node in nodes
            advice = (
                f"{edge.node} publishes TF, but not this" if there else f"no {edge.node} publishes TF: does it run?"
            )
        return self._finding("TF811", edge, message, advice)

    def _sent_rightly(self, edge: PlanEdge, one: EdgeSeen) -> Iterator[Diagnostic]:
        if one.nodes and not self._is_owners(edge, one):
            message = f"{edge.name} is published by {one.publisher}; the owner is {edge.owner} ({edge.node})"
            ours = any(node in process.nodes for process in self.plan.processes for node in one.nodes)
            advice = f"end {one.publisher}, or switch its TF off"
            if ours:
                advice = (
                    f"{one.publisher} is this robot's own: was it started with another profile, or before a change?"
                )
            yield self._finding("TF801", edge, message, advice)
        fixed = edge.kind == "static"
        if one.strand.static != fixed:
            came, wanted = ("/tf_static", "/tf") if one.strand.static else ("/tf", "/tf_static")
            message = f"{edge.name} came on {came}, declared for {wanted}"
            yield self._finding("TF809", edge, message, "static: true says that the owner sends it on /tf_static")
        if one.strand.refused is not None:
            message = f"tf2 refuses {one.strand.refusals} of {one.strand.tally.count} of {_from(one)} → {edge.child}"
            yield self._finding("TF831", edge, f"{message}: {one.strand.refused.text}")

    def _value(self, edge: PlanEdge, one: EdgeSeen) -> Iterator[Diagnostic]:
        if one.strand.refused is not None:
            return
        off = self._off(edge, one.strand.pose)
        if off is None or (off.xyz_m <= self.tolerance.xyz_m and off.rot_rad <= self.tolerance.rot_rad):
            return
        message = f"the pose of {edge.child} in {one.strand.parent} is off by {off.text}"
        said = f"seen {shown(one.strand.pose)}; expected {shown(edge.pose)}"
        yield self._finding("TF846", edge, f"{message}: {said}")

    def _off(self, edge: PlanEdge, seen: Pose) -> Offset | None:
        """Return how far the pose is from what is fixed of it, None where nothing is."""
        off = offset_of(edge.pose, seen)
        if edge.joint is not None:
            if edge.joint.type in _TURNING:
                return Offset(off.xyz_m, 0.0)
            return Offset(0.0, off.rot_rad) if edge.joint.type == "prismatic" else None
        owner = self.plan.process(edge.owner)
        if edge.kind != "static" or any(driven.publishes for driven in owner.drives):
            return None
        # Another owner's pose is the identity where the robot says none.
        return off if owner.kind == "static" or edge.pose != Pose() else None

    def _times(self, edge: PlanEdge, one: EdgeSeen) -> Iterator[Diagnostic]:
        """Judge whether it comes, and often enough."""
        rate, limit_s = edge.rate, edge.silent_after_s
        if one.present is False:
            yield self._finding("TF804", edge, f"{one.publisher or edge.node}, which published {edge.name}, has left")
            return
        if one.strand.static or rate is None or limit_s is None:
            return
        if one.age_s > limit_s:
            yield self._finding("TF804", edge, f"{edge.name} has not come for {one.age_s:.2f} s, declared {rate:g} Hz")
            return
        gap_s, seen_rate = one.timing.longest_gap_s, one.timing.rate
        if gap_s is not None and gap_s > limit_s:
            yield self._finding("TF804", edge, f"{edge.name} did not come for {gap_s:.2f} s, declared {rate:g} Hz")
        elif seen_rate is not None and one.strand.tally.count >= FEWEST and seen_rate < SLOW_BELOW * rate:
            yield self._finding("TF805", edge, f"{edge.name} comes with {seen_rate:.3g} Hz, declared {rate:g} Hz")

    def _several(self, edge: PlanEdge, rightly: Sequence[EdgeSeen]) -> Iterator[Diagnostic]:
        """Judge publishers that all have the owner's name: there is one too many."""
        owners = [one for one in rightly if one.nodes == (edge.node,) and one.present]
        if len({one.strand.gid for one in owners if one.strand.static == owners[0].strand.static}) > 1:
            message = f"{edge.name} is published by {len(owners)} nodes {edge.node}"
            yield self._finding("TF801", edge, message, "is the robot running twice?")


def _from(one: EdgeSeen) -> str:
    return f"{one.strand.parent} (from {one.publisher})" if one.publisher else one.strand.parent


def summary(verdicts: Sequence[Verdict]) -> str:
    """Return one line: how many edges are as expected, and how many are not declared."""
    planned = [one for one in verdicts if one.owner is not None]
    right = sum(not one.found for one in planned)
    extra = len(verdicts) - len(planned)
    more = f", {extra} that nobody declared" if extra else ""
    return f"{right} of {len(planned)} edges as expected{more}"
