"""The plan's parts by the topics that they are published on; this module imports no ROS."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tfcompose.plan import Plan, PlanEdge

#: The topics of moving and of fixed edges, where nothing moves them.
GLOBAL = ("/tf", "/tf_static")


def parts_of(plan: Plan) -> dict[tuple[str, str], Plan]:
    """Return, for each pair of topics (moving, fixed) that owners publish on, the plan with the edges on these."""
    topics = {process.name: process.topics for process in plan.processes}
    edges: dict[tuple[str, str], list[PlanEdge]] = {}
    for edge in plan.edges:
        edges.setdefault(topics.get(edge.owner, GLOBAL), []).append(edge)
    return {pair: replace(plan, edges=tuple(some)) for pair, some in edges.items()}
