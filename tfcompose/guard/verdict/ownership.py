"""Ownership rules that guard, verify and tree share: which publisher may send an edge."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tfcompose.model.plan import Plan, PlanEdge


def code_of(edge: PlanEdge, parent: str, *, static: bool, owner: bool, sure: bool) -> str:
    """Return the code of the fault of a planned edge received with ``parent``; "" without one.

    ``static``: it arrived on /tf_static. ``owner``: the owner may have sent it. ``sure``: no other
    node can have sent it.
    """
    if not edge.may_hang_on(parent):
        return "TF802"
    if not owner:
        return "TF801"
    return "TF809" if sure and static != (edge.kind == "static") else ""


def relays_of(plan: Plan) -> frozenset[str]:
    """Return the nodes that may forward edges of other processes: strict guards of all hosts."""
    hosts = {None, *(process.host for process in plan.processes)}
    return frozenset(node for host in hosts for node in plan.guards_of(host))


def may_be_owners(
    edge: PlanEdge, nodes: Sequence[str], relays: frozenset[str] = frozenset()
) -> bool:
    """Return whether one of the nodes is the edge's owner or forwards the owner's messages."""
    return edge.node in nodes or not relays.isdisjoint(nodes)
