"""Edges of a running plan that can be adjusted, by the names that people type."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.foundation.findings import Note, RejectedError, did_you_mean, finding
from tfcompose.foundation.text import list_names

if TYPE_CHECKING:
    from tfcompose.foundation.findings import Finding
    from tfcompose.model.plan import Plan, PlanEdge

_LISTED = 12


def select_edges(plan: Plan, name: str | None, *, restores: bool) -> list[PlanEdge]:
    """Return the edge that mounts a sensor, or else the one above a frame; None: all adjusted.

    Raises:
        RejectedError: if there is no such mount, its publisher takes no other pose, or, where it
            ``restores`` an earlier one, nothing adjusted it.
    """
    if name is None:
        return list(plan.adjusted)
    edge = _edge_of(plan, name)
    if not plan.is_adjustable(edge):
        raise RejectedError([_not_adjustable(plan, edge)])
    if restores and not edge.earlier:
        adjusted = ", ".join(map(short_name, plan.adjusted))
        advice = f"adjusted: {adjusted}" if adjusted else ""
        message = f"{edge.name} is not adjusted"
        raise RejectedError([finding("TF666", message, None, help=advice)])
    return [edge]


def short_name(edge: PlanEdge) -> str:
    """Return what people call the mount: its sensor, or its frame."""
    return edge.mounts or edge.child


def _edge_of(plan: Plan, name: str) -> PlanEdge:
    names = (name, f"{plan.ros.frame_prefix}{name}")
    edges = [edge for edge in plan.edges if edge.mounts == name]
    edges += [edge for edge in plan.edges if edge.child in names]
    if not edges:
        mounts = [short_name(edge) for edge in plan.edges if plan.is_adjustable(edge)]
        has = f"its mounts are {list_names(mounts, _LISTED)}" if mounts else ""
        advice = did_you_mean(name, [*mounts, *(edge.child for edge in plan.edges)], has)
        message = f"{plan.robot} has no mount {name}"
        raise RejectedError([finding("TF664", message, None, help=advice)])
    return edges[0]


def _not_adjustable(plan: Plan, edge: PlanEdge) -> Finding:
    reason = f"{edge.owner} ({edge.node}) publishes it"
    if edge.joint:
        reason = f"the joint {edge.joint.name} moves it"
    above = next((candidate for candidate in plan.edges if candidate.child == edge.parent), None)
    is_mount = above is not None and plan.is_adjustable(above)
    advice = f"nudge the mount above it: {short_name(above)}" if above and is_mount else ""
    message = f"{edge.name} cannot be nudged: {reason}"
    declared = Note(f"{edge.name} is declared in {edge.source.file}:{edge.source.line}")
    return finding("TF665", message, None, help=advice, notes=[declared])
