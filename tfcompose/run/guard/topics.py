"""Robots beside each other on topics of their own: one guard, and one judge for each pair of TF topics.

What one owner may publish on its robot's topics is an offence on another's, so each pair is judged alone.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from tfcompose.ipc import Clear, Complete
from tfcompose.plan.topics import parts_of

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from tfcompose.ipc import GuardEvent
    from tfcompose.plan import Plan, PlanProcess

    Topics = tuple[str, str]


def plans_by_topics(plan: Plan, guard: PlanProcess) -> dict[Topics, Plan]:
    """Return, for each pair of topics (moving, fixed) that owners publish on, the plan with the edges on these.

    The guard's own topics are always among them.
    """
    parts = parts_of(plan)
    own = parts.pop(guard.topics, None) or replace(plan, edges=())
    return {guard.topics: own, **parts}


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
