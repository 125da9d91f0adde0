"""What differs from the plan: a running tree or a recording, edge by edge, and what there is to say of it.

What is fixed is compared by value: what tfcompose publishes itself, what another owner sends on /tf_static with a pose
that the robot says, and of a joint what its motion leaves as it is. Frames inside a sensor that its driver publishes
may be calibrated: they are compared as far as the preset says how well it knows them.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

from tfcompose.findings import did_you_mean
from tfcompose.geometry import Pose
from tfcompose.plan import SLOW_BELOW
from tfcompose.verdict.offence import SELF, Offence, code_of, may_be_owners, relays_of
from tfcompose.verdict.offset import DEFAULT_TOLERANCE, Offset, offset_of
from tfcompose.verdict.poses import Expected, expected_of, is_off

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from tfcompose.observe.census import EdgeSeen
    from tfcompose.observe.seen import Seen
    from tfcompose.plan import Plan, PlanEdge

#: A rate is judged from so many messages on.
FEWEST = 4
#: How long a publisher may stay without a name before it is judged all the same.
NAMELESS_S = 0.7
_TURNING = frozenset({"revolute", "continuous"})


@dataclass(frozen=True, slots=True)
class Difference:
    """One thing that is wrong with one edge.

    ``edge`` is the planned one, None where nobody declared it, ``seen`` what came, None where nothing did. What else
    there is depends on the code: an ``offence``; a ``driver``'s frame that is elsewhere; how far a pose is ``off``,
    whoever sent it; the ``quiet_s`` in which nothing came, which are ``over`` or not.
    """

    code: str
    edge: PlanEdge | None
    seen: EdgeSeen | None = None
    offence: Offence | None = None
    driver: Expected | None = None
    off: Offset | None = None
    quiet_s: float = 0.0
    over: bool = False


def differences(seen: Seen, plan: Plan, tolerance: Offset = DEFAULT_TOLERANCE) -> list[Difference]:
    """Return what differs from the plan: edge by edge in its order, then what is not in it."""
    comparison = _Comparison(seen, plan, tolerance)
    planned = [one for edge in plan.edges for one in comparison.of_planned(edge)]
    return [*planned, *comparison.undeclared()]


@dataclass
class _Comparison:
    seen: Seen
    plan: Plan
    tolerance: Offset
    _relays: frozenset[str] = field(init=False)

    def __post_init__(self) -> None:
        self._relays = relays_of(self.plan)

    @cached_property
    def by_child(self) -> dict[str, list[EdgeSeen]]:
        found: dict[str, list[EdgeSeen]] = {}
        for one in self.seen.edges:
            found.setdefault(one.strand.child, []).append(one)
        return found

    @cached_property
    def drivers(self) -> dict[str, Expected]:
        return expected_of(self.plan)

    def of_planned(self, edge: PlanEdge) -> Iterator[Difference]:
        some = self.by_child.get(edge.child, [])
        for one in some:
            yield from self._offence(edge, one)
            yield from self._value(edge, one)
        yield from self._twice(edge, some)
        hanging = [one for one in some if one.strand.parent != edge.child]
        if not hanging:
            yield Difference("TF811", edge)
        owners = [
            one
            for one in hanging
            if edge.may_hang_on(one.strand.parent) and (not one.nodes or self._may_own(edge, one))
        ]
        if owners:  # one that was started again is judged by what came last
            newest = max(owners, key=lambda one: (one.present is not False, one.strand.tally.last_ns))
            yield from _times(edge, newest, simulated=self.plan.ros.clock == "sim")

    def undeclared(self) -> Iterator[Difference]:
        planned = {edge.child for edge in self.plan.edges}
        for one in self.seen.edges:
            strand = one.strand
            if strand.child in planned or self.plan.may_be_undeclared(strand.parent, strand.child):
                continue
            yield self._told("TF803", None, one)

    def _offence(self, edge: PlanEdge, one: EdgeSeen) -> Iterator[Difference]:
        strand = one.strand
        if strand.parent == strand.child:
            yield self._told(SELF, edge, one)
            return
        unknown = not one.nodes and (self.seen.recorded or one.known_s < NAMELESS_S)
        owner, sure = unknown or self._may_own(edge, one), unknown or len(one.nodes) == 1
        code = code_of(edge, strand.parent, static=strand.static, owner=owner, sure=sure)
        if code:
            off = self._off(edge, strand.pose) if code == "TF801" and strand.refused_row is not strand.row else None
            found = self._told(code, edge, one)
            yield replace(found, off=off) if off is not None and off.beyond(self.tolerance) else found

    def _told(self, code: str, edge: PlanEdge | None, one: EdgeSeen, *, namesake: bool = False) -> Difference:
        strand = one.strand
        offence = Offence(
            code, strand.parent, strand.child, one.nodes, strand.static, edge,
            namesake=namesake, recorded=self.seen.recorded,
        )  # fmt: skip
        return Difference(code, edge, one, offence)

    def _twice(self, edge: PlanEdge, some: Sequence[EdgeSeen]) -> Iterator[Difference]:
        """Judge publishers that all have the owner's name: there is one too many."""
        namesakes: dict[bytes | None, EdgeSeen] = {}
        for one in sorted(some, key=lambda one: one.strand.first_ns):
            if one.nodes == (edge.node,) and one.present and edge.may_hang_on(one.strand.parent):
                namesakes.setdefault(one.strand.gid, one)
        of_kind = [
            one for one in namesakes.values() if one.strand.static == next(iter(namesakes.values())).strand.static
        ]
        for other in of_kind[1:]:
            yield self._told("TF801", edge, other, namesake=True)

    def _may_own(self, edge: PlanEdge, one: EdgeSeen) -> bool:
        return may_be_owners(edge, one.nodes, self._relays)

    def _value(self, edge: PlanEdge, one: EdgeSeen) -> Iterator[Difference]:
        strand = one.strand
        if strand.refused_row is strand.row or not edge.may_hang_on(strand.parent):
            return
        if one.nodes and not self._may_own(edge, one):
            return  # somebody else's value is told with who it is
        driver = self.drivers.get(edge.child)
        if driver is not None:
            if is_off(driver, strand.pose):
                yield Difference("TF828", edge, one, driver=driver)
            return
        off = self._off(edge, strand.pose)
        if off is not None and off.beyond(self.tolerance):
            yield Difference("TF846", edge, one, off=off)

    def _off(self, edge: PlanEdge, pose: Pose) -> Offset | None:
        """Return how far the pose is from what is fixed of it, None where nothing is."""
        off = offset_of(edge.pose, pose)
        if edge.joint is not None:
            if edge.joint.type in _TURNING:
                return Offset(off.xyz_m, 0.0)
            return Offset(0.0, off.rot_rad) if edge.joint.type == "prismatic" else None
        owner = self.plan.process(edge.owner)
        if edge.kind != "static" or any(driven.publishes for driven in owner.drives):
            return None
        # Another owner's pose is the identity where the robot says none.
        return off if owner.kind == "static" or edge.pose != Pose() else None


def _times(edge: PlanEdge, one: EdgeSeen, *, simulated: bool) -> Iterator[Difference]:
    """Judge whether it comes, and often enough; a simulation may go slower than the time of day."""
    rate, limit_s = edge.rate, edge.silent_after_s
    if one.present is False:
        yield Difference("TF804", edge, one, quiet_s=one.age_s)
        return
    if one.strand.static or rate is None or limit_s is None:
        return
    speed = min(1.0, one.strand.speed) if simulated else 1.0
    limit_s /= speed
    gap_s, seen_rate = one.timing.longest_gap_s, one.timing.rate
    if one.age_s > limit_s:
        yield Difference("TF804", edge, one, quiet_s=one.age_s)
    elif gap_s is not None and gap_s > limit_s:
        yield Difference("TF804", edge, one, quiet_s=gap_s, over=True)
    elif seen_rate is not None and one.strand.tally.count >= FEWEST and seen_rate < SLOW_BELOW * rate * speed:
        yield Difference("TF805", edge, one)


def missing_help(seen: Seen, plan: Plan, edge: PlanEdge) -> str:
    """Return what to do about an edge that never came."""
    planned = {one.child for one in plan.edges}
    strangers = [one.strand.child for one in seen.edges if one.strand.child not in planned]
    meant = did_you_mean(edge.child, strangers)
    if meant or seen.recorded:
        return meant
    if edge.node in seen.nodes:
        return f"{edge.node} is running and sends nothing: what does it wait for, and is its TF switched on?"
    kind = next((process.kind for process in plan.processes if process.name == edge.owner), "")
    if kind == "external":
        return f"nobody named {edge.node} is seen: start it, or correct node: of the process {edge.owner}"
    return f"nobody named {edge.node} is seen: is the robot up? tfcompose ps"
