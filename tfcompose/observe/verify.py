"""Expected against seen: a verdict for each edge of a plan, of a running tree or a bag."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from tfcompose.observe.differences import differences
from tfcompose.observe.refused import refused_transform
from tfcompose.observe.seen import Seen
from tfcompose.observe.telling import told
from tfcompose.plan.topics import parts_of

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from tfcompose.findings import Finding, Span
    from tfcompose.observe.census import Census
    from tfcompose.plan import Plan
    from tfcompose.verdict.offset import Offset

    Topics = tuple[str, str]


@dataclass(frozen=True, slots=True)
class Verdict:
    """What is wrong with an edge, nothing if all is as expected; ``owner`` is None where nobody declared it."""

    edge: str
    owner: str | None
    found: tuple[Finding, ...]


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
    found: dict[str, list[Finding]] = {edge.child: [] for edge in plan.edges}
    extra = []
    for topics, part in parts_of(plan).items():
        seen = seen_of(censuses[topics], now_ns, topics)
        for edge in seen.edges:
            if edge.strand.refused is not None and edge.strand.child in found:
                found[edge.strand.child] += refused_transform(edge)
        for one in differences(seen, part, tolerance):
            # The parts of a plan differ in their edges only; a process is looked up in the whole.
            place = (places or {}).get(one.edge.child) if one.edge else None
            said = told([one], seen, plan, place, slow_is="error")
            if one.edge is None and one.seen is not None:
                extra.append(Verdict(one.seen.name, None, (said,)))
            elif one.edge is not None:
                found[one.edge.child].append(said)
    return [*(Verdict(edge.name, edge.owner, tuple(found[edge.child])) for edge in plan.edges), *extra]


def seen_of(census: Census, now_ns: int, topics: Topics) -> Seen:
    """Return what a census has seen until ``now_ns`` on the topics (moving, fixed)."""
    return Seen(
        max(0, now_ns - census.begun_ns) / 1e9,
        topics,
        tuple(census.edges(now_ns)),
        tuple(census.publishers.values()),
        census.others,
        recorded=census.present is None,
    )


def summary(verdicts: Sequence[Verdict]) -> str:
    """Return one line: how many edges are as expected, and how many are not declared."""
    planned = [one for one in verdicts if one.owner is not None]
    right = sum(not one.found for one in planned)
    extra = len(verdicts) - len(planned)
    more = f", {extra} that nobody declared" if extra else ""
    return f"{right} of {len(planned)} edges as expected{more}"
