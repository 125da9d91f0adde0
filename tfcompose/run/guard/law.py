"""Who may publish what: one edge that was seen, against the plan and the tree."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

from tfcompose.run.guard.shape import Shape
from tfcompose.run.guard.turns import Turns
from tfcompose.verdict.offence import LOOP, SELF, TWO_WRITERS, Offence, code_of

if TYPE_CHECKING:
    from tfcompose.plan import Plan, PlanEdge
    from tfcompose.run.guard.cases import Start
    from tfcompose.run.guard.senders import Senders

#: The publishers that a plan starts once and never again.
_OWN = ("static", "joints")


@dataclass(frozen=True, slots=True)
class Sight:
    """An edge that somebody published on a topic."""

    gid: bytes | None
    parent: str
    child: str
    static: bool


class Law:
    """The plan's edges and owners, and what others have added; ``changes`` counts what can change a judgement."""

    def __init__(self, plan: Plan, senders: Senders, start: Start) -> None:
        self.changes = 0
        self.owners = Turns()
        self.planned: dict[str, PlanEdge] = {edge.child: edge for edge in plan.edges}
        self.started = {process.name: process.kind != "external" for process in plan.processes}
        self._plan = plan
        self._senders = senders
        self._start = start
        self._others = Turns()
        self._shape = Shape(plan)

    def offence(self, sight: Sight, nodes: tuple[str, ...], now: float) -> Offence | None:
        """Return what is wrong with the sight, which one of these nodes sent, or None."""
        edge = self.planned.get(sight.child)
        parent, child, static = sight.parent, sight.child, sight.static
        if parent == child:
            return Offence(SELF, parent, child, nodes, static, edge)
        if edge is None:
            return self._stranger(sight, nodes, now)
        code = code_of(edge, parent, static=static, owner=edge.node in nodes, sure=len(nodes) == 1)
        loop = self._shape.loop(parent, child, now) if code == "TF802" else ()
        namesake = code in {"", "TF809"} and self._is_namesake(edge, sight)
        code = LOOP if loop else "TF801" if namesake else code
        return Offence(code, parent, child, nodes, static, edge, namesake, loop) if code else None

    def _stranger(self, sight: Sight, nodes: tuple[str, ...], now: float) -> Offence | None:
        """Judge an edge that the plan does not have."""
        parent, child, static = sight.parent, sight.child, sight.static
        if self._shape.saw(parent, child, now, static=static):
            self.changes += 1
        undeclared = not self._plan.may_be_undeclared(parent, child)
        loop = self._shape.loop(parent, child, now)
        ours = any(self._shape.is_planned(*edge) for edge in pairwise(loop))
        if loop and (ours or undeclared):
            return Offence(LOOP, parent, child, nodes, static, None, loop=loop)
        if undeclared:
            return Offence("TF803", parent, child, nodes, static, None)
        if sight.gid is None:
            return None
        current, before = self._others.take(child, sight.gid)
        self.changes += current != sight.gid
        if not (current != sight.gid == before and self._senders.is_present(current)):
            return None
        named = self._senders.nodes(current, static=static)
        other = named[0] if len(named) == 1 else "another"
        return Offence(TWO_WRITERS, parent, child, nodes, static, None, detail=f"by {other}")

    def _is_namesake(self, edge: PlanEdge, sight: Sight) -> bool:
        """Whether a publisher has the owner's name and is not the owner.

        It is where the plan starts the owner and this one spoke before; where two take turns: A, B, and A again; and
        where tfcompose's own publisher, which is never restarted, is there twice.
        """
        gid, sender = sight.gid, self._senders.sender(sight.gid)
        if gid is None or sender is None:
            return False
        ours, start = self.started.get(edge.owner, False), self._start
        if ours and (start.cleared is None or sender.first_ns < start.cleared_ns):
            return True
        current, before = self.owners.take(edge.child, gid)
        if current == gid:
            return False
        self.changes += 1
        return (before == gid and not sight.static) or (edge.owner in _OWN and self._senders.is_present(current))
