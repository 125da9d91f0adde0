"""Differences from the plan as findings: those of one kind and one publisher, or owner, are one finding."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from tfcompose.findings import Finding, Note
from tfcompose.observe.differences import missing_help
from tfcompose.verdict.driven import drives_of, sensor_of
from tfcompose.verdict.poses import driver_pose_differs, pose_differs
from tfcompose.verdict.timing import left, never_seen, silent, slow
from tfcompose.verdict.violation import violation

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from tfcompose.catalogue import Severity
    from tfcompose.findings import Span
    from tfcompose.observe.differences import Difference
    from tfcompose.observe.seen import Seen
    from tfcompose.plan import Plan

    Group = Sequence[Difference]

#: Of poses that are off so many are told.
MOST_POSES = 6


def grouped(found: Iterable[Difference]) -> list[list[Difference]]:
    """Return those that are told together, in the order in which the first of each came."""
    groups: dict[tuple[object, ...], list[Difference]] = {}
    for one in found:
        groups.setdefault(_key(one), []).append(one)
    return list(groups.values())


def told(group: Group, seen: Seen, plan: Plan, place: Span | None = None, slow_is: Severity = "warning") -> Finding:
    """Return the finding for differences of one group; ``place`` is where the first edge stands in the robot's file."""
    first = group[0]
    found = _offences(group, seen, plan, place) if first.offence else _told(group, seen, plan, place, slow_is)
    # Of a recording nobody can mend what its nodes did.
    return replace(found, help="") if seen.recorded and first.code in {"TF804", "TF805", "TF846"} else found


def _told(group: Group, seen: Seen, plan: Plan, place: Span | None, slow_is: Severity) -> Finding:
    first = group[0]
    edges = [one.edge for one in group if one.edge is not None]
    if first.seen is None:
        return never_seen(edges, missing_help(seen, plan, edges[0]), place)
    strand = first.seen.strand
    if first.driver is not None:
        off = [(one.driver, one.seen.strand.pose) for one in group if one.driver is not None and one.seen is not None]
        return driver_pose_differs(first.seen.publisher, off, place)
    if first.off is not None:
        return _poses(group, place)
    if first.code == "TF805":
        return slow(edges, min(one.seen.timing.rate or 0.0 for one in group if one.seen), place, slow_is)
    if strand.static:
        return left(edges, place)
    gone = first.seen.present is False
    return silent(edges, max(one.quiet_s for one in group), place, over=first.over, gone=gone)


def _key(one: Difference) -> tuple[object, ...]:
    if one.offence is not None:
        owner = one.edge.owner if one.edge else None
        return one.code, one.offence.who, owner, one.offence.static if one.code == "TF809" else None
    if one.edge is None:
        return (one.code,)
    edge = one.edge
    sensor = one.driver.driven.sensor if one.driver else None
    rate = edge.rate if one.code in {"TF804", "TF805"} else None
    return one.code, edge.owner, rate, one.over, sensor, one.seen.publisher if one.off and one.seen else None


def _offences(group: Group, seen: Seen, plan: Plan, place: Span | None) -> Finding:
    offences = [one.offence for one in group if one.offence is not None]
    first = group[0]
    where = seen.where(first.seen) if first.seen else ""
    found = violation(offences, plan, where, sensor_of(offences[0], drives_of(plan)), place)
    found = replace(found, notes=(*found.notes, *_elsewhere(group)))
    if not offences[0].namesake:
        return found
    gid = first.seen.strand.gid if first.seen else None
    others = [one for one in seen.publishers if one.node in offences[0].nodes and one.gid != gid and one.where]
    notes = [Note(f"{one.node} runs {one.where}") for one in others]
    return replace(found, notes=(*found.notes, *dict.fromkeys(notes)))


def _elsewhere(group: Group) -> list[Note]:
    """Return how far the poses are off that came from somebody who is not the owner."""
    off = [(one.offence, one.off) for one in group if one.offence and one.off]
    notes = [Note(f"its pose of {what.child} in {what.parent} is off by {far.text}") for what, far in off[:MOST_POSES]]
    return [*notes, Note(f"and {len(off) - len(notes)} more are off")] if len(off) > len(notes) else notes


def _poses(group: Group, place: Span | None) -> Finding:
    off = [(one.edge, one.seen.strand.parent, one.seen.strand.pose) for one in group if one.edge and one.seen]
    publisher = group[0].seen.publisher if group[0].seen else ""
    return pose_differs(off, publisher, place)
