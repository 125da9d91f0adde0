"""Robots beside each other on topics of their own: one guard, and one judge for each pair of TF topics.

What one owner may publish on its robot's topics is an offence on another's, so each pair is judged alone.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from tfcompose.run.events import Clear, Complete

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from tfcompose.plan import Plan, PlanEdge, PlanProcess
    from tfcompose.run.events import GuardEvent

    Topics = tuple[str, str]


def plans_by_topics(plan: Plan, guard: PlanProcess) -> dict[Topics, Plan]:
    """Return, for each pair of topics (moving, fixed) that owners publish on, the plan with the edges on these.

    The guard's own topics are always among them.
    """
    topics = {process.name: _topics(process) for process in plan.processes}
    edges: dict[Topics, list[PlanEdge]] = {_topics(guard): []}
    for edge in plan.edges:
        edges.setdefault(topics[edge.owner], []).append(edge)
    return {pair: replace(plan, edges=tuple(some)) for pair, some in edges.items()}


def _topics(process: PlanProcess) -> Topics:
    return (process.remap.get("/tf", "/tf"), process.remap.get("/tf_static", "/tf_static"))


def together(emit: Callable[[GuardEvent], None], plans: Sequence[Plan]) -> Callable[[GuardEvent], None]:
    """Return what passes on the events of the judges of these plans.

    That all is clear, and that the tree is complete, is said once: when the last judge has said so.
    """
    waiting = {Clear: len(plans), Complete: sum(bool(plan.edges) for plan in plans)}

    def passed_on(event: GuardEvent) -> None:
        if isinstance(event, Complete):
            waiting[Complete] -= event.edges > 0
            if waiting[Complete] == 0 and event.edges:
                emit(Complete(sum(len(plan.edges) for plan in plans)))
            return
        if isinstance(event, Clear):
            waiting[Clear] -= 1
            if waiting[Clear]:
                return
        emit(event)

    return passed_on
