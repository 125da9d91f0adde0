"""The tree as it is seen: the plan's edges, and those that others add; whether an edge closes a loop."""

from __future__ import annotations

from collections import OrderedDict
from typing import TYPE_CHECKING

from tfcompose.tree import loop_closed_by

if TYPE_CHECKING:
    from tfcompose.plan import Plan

#: tf2's buffers keep moving edges for 10 s; one that did not come for so long closes no loop any more.
KEPT_S = 10.0
MOST = 10_000


class Shape:
    """Each frame's parent."""

    def __init__(self, plan: Plan) -> None:
        self._planned = {edge.child: edge.parent for edge in plan.edges}
        self._others: OrderedDict[str, tuple[str, float]] = OrderedDict()

    def saw(self, parent: str, child: str, now: float, *, static: bool) -> bool:
        """Note an edge that nobody planned, and return whether it changes the tree."""
        before = self._others.get(child)
        self._others[child] = (parent, float("inf") if static else now)
        self._others.move_to_end(child)
        if len(self._others) > MOST:
            self._others.popitem(last=False)
        return before is None or before[0] != parent

    def loop(self, parent: str, child: str, now: float) -> tuple[str, ...]:
        """Return the frames of the loop that the edge closes, from ``child`` down to it again; () if it closes none."""
        return loop_closed_by((parent, child), lambda frame: self._parent(frame, now))

    def is_planned(self, parent: str, child: str) -> bool:
        """Whether the plan has this edge."""
        return self._planned.get(child) == parent

    def _parent(self, frame: str, now: float) -> str | None:
        if frame in self._planned:
            return self._planned[frame]
        parent, seen = self._others.get(frame, (None, 0.0))
        return parent if now - seen < KEPT_S else None
