"""What is seen against a plan: who publishes an edge, below which parent, on which topic, how often."""

from __future__ import annotations

from fnmatch import fnmatchcase
from typing import TYPE_CHECKING

from tfcompose.diagnostic import Diagnostic, Note, finding
from tfcompose.observe.diagnose.rates import FEWEST, SLOW, SURE_S, is_silent
from tfcompose.observe.seen import counted, seconds, who

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.diagnostic import Severity
    from tfcompose.observe.census import EdgeSeen
    from tfcompose.observe.seen import Seen
    from tfcompose.plan import Plan, PlanEdge


def edge_never_seen(seen: Seen) -> Iterator[Diagnostic]:
    """Edges of the plan do not come."""
    if seen.plan is None:
        return
    children = {edge.strand.child for edge in seen.taken}
    missing: dict[tuple[str, str], list[PlanEdge]] = {}
    for edge in seen.plan.edges:
        if edge.child not in children:
            missing.setdefault((edge.owner, edge.node), []).append(edge)
    for (owner, node), edges in missing.items():
        more = f" and {counted(len(edges) - 1, 'more edge')}" if len(edges) > 1 else ""
        message = f"{edges[0].name}{more} of {owner} ({node}) {'were' if more else 'was'} not published"
        notes = [Note(f"{edge.name} is declared in {edge.source[0]}:{edge.source[1]}") for edge in edges[:6]]
        yield finding("TF811", message, None, notes=notes, help=_absent_help(seen, edges[0]))


def wrong_owner(seen: Seen) -> Iterator[Diagnostic]:
    """A node publishes edges that another owns."""
    found: dict[tuple[str, str, str], list[tuple[PlanEdge, EdgeSeen]]] = {}
    for plan_edge, edge in _pairs(seen):
        if plan_edge.may_hang_on(edge.strand.parent) and edge.nodes and plan_edge.node not in edge.nodes:
            found.setdefault((who(edge), plan_edge.owner, plan_edge.node), []).append((plan_edge, edge))
    for (publisher, owner, node), pairs in found.items():
        plan_edge, edge = pairs[0]
        more = f" and {counted(len(pairs) - 1, 'more edge')}" if len(pairs) > 1 else ""
        message = f"{edge.name}{more} {'are' if more else 'is'} published by {publisher}; the owner is {owner} ({node})"
        advice = f"end {publisher}, or switch its TF off; tf2 takes whatever came last"
        yield finding("TF801", message, None, notes=_notes(seen, pairs), help=advice)


def wrong_parent(seen: Seen) -> Iterator[Diagnostic]:
    """A node hangs a frame on another parent than the plan does."""
    for plan_edge, edge in _pairs(seen):
        if not plan_edge.may_hang_on(edge.strand.parent):
            owner = f"{plan_edge.owner} ({plan_edge.node}) {plan_edge.name}"
            message = f"{plan_edge.child} has a second parent: {who(edge)} publishes {edge.name}, {owner}"
            advice = f"end {who(edge)}, or switch its TF off; tf2 takes whatever came last"
            yield finding("TF802", message, None, notes=_notes(seen, [(plan_edge, edge)]), help=advice)


def wrong_topic(seen: Seen) -> Iterator[Diagnostic]:
    """An owner sends an edge on /tf that is fixed, or the other way round."""
    for plan_edge, edge in _pairs(seen):
        if plan_edge.node in edge.nodes and edge.strand.static != (plan_edge.kind == "static"):
            here, there = seen.topics[edge.strand.static], seen.topics[not edge.strand.static]
            message = f"{edge.name} is published by its owner {who(edge)} on {here}, declared for {there}"
            notes = _notes(seen, [(plan_edge, edge)])
            yield finding("TF809", message, None, notes=notes, help="static: true says that it comes on /tf_static")


def owner_twice(seen: Seen) -> Iterator[Diagnostic]:
    """The owner of an edge runs twice."""
    rivals: dict[str, dict[bytes, EdgeSeen]] = {}
    for plan_edge, edge in _pairs(seen):
        if edge.strand.gid and edge.present and plan_edge.node in edge.nodes:
            rivals.setdefault(plan_edge.node, {})[edge.strand.gid] = edge
    for node, found in rivals.items():
        same = [edge for edge in found.values() if edge.strand.child == next(iter(found.values())).strand.child]
        if len(same) > 1:
            notes = [Note(f"one runs {seen.where(edge) or 'somewhere'}") for edge in same]
            message = f"{same[0].name} is published by {node} and by another {node}"
            yield finding("TF801", message, None, notes=notes, help="end one of the two; tf2 takes whatever came last")


def undeclared(seen: Seen) -> Iterator[Diagnostic]:
    """Edges come that the plan does not have."""
    if seen.plan is None:
        return
    strangers: dict[str, list[EdgeSeen]] = {}
    for edge in seen.taken:
        if edge.strand.child not in seen.planned and not _may_be_undeclared(seen.plan, edge):
            strangers.setdefault(who(edge), []).append(edge)
    for name, edges in strangers.items():
        more = f" and {counted(len(edges) - 1, 'more edge')}" if len(edges) > 1 else ""
        message = f"{edges[0].name}{more} {'are' if more else 'is'} published by {name}, and nobody declared "
        message += "them" if more else "it"
        allowed = f"{{parent: {edges[0].strand.parent}, child: {edges[0].strand.child}}}"
        advice = f"declare it under frames, or allow it: guard: {{allow: [{allowed}]}}"
        severity: Severity = "error" if seen.plan.guard.unknown_edges == "error" else "warning"
        notes = [Note(edge.name) for edge in edges[1:7]]
        yield finding("TF803", message, None, severity=severity, notes=notes, help=advice)


def owner_slow_or_silent(seen: Seen) -> Iterator[Diagnostic]:
    """An owner sends less often than declared, or nothing any more."""
    for plan_edge, edge in _pairs(seen):
        if edge.strand.static or plan_edge.node not in edge.nodes:
            continue
        owner = f"{plan_edge.owner} ({plan_edge.node})"
        notes = [Note(f"declared in {plan_edge.source[0]}:{plan_edge.source[1]}")]
        rate, asked = edge.timing.rate, plan_edge.rate
        if is_silent(edge, asked):
            message = f"{edge.name}: nothing for {seconds(edge.age_s)} from {owner}"
            yield finding("TF804", message, None, notes=notes, help="is it running, and what does it wait for?")
        elif asked and rate is not None and rate < SLOW * asked and _is_sure(seen, edge):
            message = f"{edge.name} comes with {rate:.3g} Hz from {owner}, declared are {asked:g} Hz"
            yield finding(
                "TF805", message, None, severity="warning", notes=notes, help="raise its rate, or declare what it is"
            )


def _is_sure(seen: Seen, edge: EdgeSeen) -> bool:
    return edge.strand.tally.count >= FEWEST or seen.seconds > SURE_S


def _pairs(seen: Seen) -> Iterator[tuple[PlanEdge, EdgeSeen]]:
    planned = {edge.child: edge for edge in seen.plan.edges} if seen.plan else {}
    for edge in seen.taken:
        if edge.strand.child in planned:
            yield planned[edge.strand.child], edge


def _absent_help(seen: Seen, edge: PlanEdge) -> str:
    kind = next((p.kind for p in seen.plan.processes if p.name == edge.owner), "") if seen.plan else ""
    if edge.node in seen.nodes:
        return f"{edge.node} is running and sends nothing: what does it wait for, and is its TF switched on?"
    if kind == "external":
        return f"nobody named {edge.node} is seen: start it, or correct node: of the process {edge.owner}"
    return f"nobody named {edge.node} is seen: is the robot up? tfcompose ps"


def _may_be_undeclared(plan: Plan, edge: EdgeSeen) -> bool:
    """Whether nobody needs to have declared the edge: by policy, or because it is another robot's."""
    parent, child, ros = edge.strand.parent, edge.strand.child, plan.ros
    if ros.frame_prefix and not child.startswith(ros.frame_prefix) and child not in ros.shared_frames:
        return True
    return plan.guard.unknown_edges == "ignore" or any(
        fnmatchcase(parent, parents) and fnmatchcase(child, children) for parents, children in plan.guard.allow
    )


def _notes(seen: Seen, pairs: list[tuple[PlanEdge, EdgeSeen]]) -> list[Note]:
    """Return where the first edges are declared, and where the publisher runs."""
    notes = [Note(f"{edge.name} is declared in {edge.source[0]}:{edge.source[1]}") for edge, _ in pairs[:6]]
    notes += [Note(f"and {len(pairs) - 6} more")] if len(pairs) > 6 else []  # noqa: PLR2004 (those above)
    where = seen.where(pairs[0][1])
    return [*notes, Note(f"{who(pairs[0][1])} runs {where}")] if where else notes
