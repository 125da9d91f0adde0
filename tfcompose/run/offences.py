"""What the guard reports, in words: the edge, who sent it, who owns it, and what to do."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from tfcompose.diagnostic import Diagnostic, Note, Severity, finding

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tfcompose.plan import GuardPolicy, Plan, PlanEdge

LISTED_AT_MOST = 12


@dataclass(frozen=True, slots=True)
class Offence:
    """One edge that was published by somebody who may not, or in a way that it may not."""

    code: str
    parent: str
    child: str
    node: str
    static: bool
    edge: PlanEdge | None

    @property
    def key(self) -> tuple[str, str, str, str]:
        """What makes it the same case."""
        return (self.code, self.parent, self.child, self.node)

    @property
    def name(self) -> str:
        """The edge that was seen."""
        return f"{self.parent} → {self.child}"

    @property
    def over(self) -> str:
        """The sentence that says that it has ended."""
        return f"{self.name} is no longer published by {self.node}"


def violation(offences: Sequence[Offence], guard: GuardPolicy) -> Diagnostic:
    """Return the finding for offences of one kind by one node."""
    first = offences[0]
    severity: Severity = "warning" if first.code == "TF803" and guard.unknown_edges == "warn" else "error"
    notes = [*_others(offences), *_declared(first)]
    return finding(first.code, _message(first, len(offences)), None, help=_help(first), notes=notes, severity=severity)


def taken(offences: Sequence[Offence]) -> Diagnostic:
    """Return the finding for edges that a node published before the start."""
    first = offences[0]
    more = f" and {len(offences) - 1} more edges" if len(offences) > 1 else ""
    message = f"{first.name}{more}: published by {first.node} before the start"
    if first.edge and first.parent != first.edge.parent:
        message += f", and the plan hangs {first.child} on {first.edge.parent}"
    notes = [*_others(offences), *_declared(first)]
    owner = first.edge.owner if first.edge else ""
    advice = f"end {first.node}, or let it own the edge: processes: {{{owner}: {{external: true, node: {first.node}}}}}"
    return finding("TF807", message, None, help=advice, notes=notes)


def volatile_writer(node: str, plan: Plan) -> Diagnostic:
    """Return the finding for a publisher on /tf_static that no TF listener accepts."""
    owned = [edge.name for edge in plan.edges if edge.node == node and edge.kind == "static"]
    notes = [Note(f"it owns {', '.join(owned[:LISTED_AT_MOST])}")] if owned else []
    message = f"{node} writes /tf_static with durability volatile, so no listener receives it"
    return finding("TF806", message, None, notes=notes, help="publish it with durability transient_local, reliable")


def _message(first: Offence, count: int) -> str:
    more = f" and {count - 1} more edges" if count > 1 else ""
    edge = first.edge
    verb = "are" if count > 1 else "is"
    if edge is None:
        return f"{first.name}{more} {verb} published by {first.node}, and nobody declared {'them' if more else 'it'}"
    owner = f"{edge.owner} ({edge.node})"
    if first.code == "TF802":
        return f"{first.child} has a second parent: {first.node} publishes {first.name}{more}, {owner} {edge.name}"
    if first.code == "TF809":
        topics = ("/tf_static", "/tf") if first.static else ("/tf", "/tf_static")
        return f"{first.name}{more} {verb} published by its owner {first.node} on {topics[0]}, declared for {topics[1]}"
    return f"{first.name}{more} {verb} published by {first.node}; the owner is {owner}"


def _help(first: Offence) -> str:
    if first.code == "TF803":
        allowed = f"{{parent: {first.parent}, child: {first.child}}}"
        return f"declare it under frames, or allow it: guard: {{allow: [{allowed}]}}"
    if first.code == "TF809":
        return "static: true says that the owner sends it on /tf_static"
    return f"end {first.node}, or switch its TF off; tf2 takes whatever came last"


def _others(offences: Sequence[Offence]) -> list[Note]:
    if len(offences) == 1:
        return []
    listed = [Note(offence.name) for offence in offences[:LISTED_AT_MOST]]
    more = len(offences) - len(listed)
    return [*listed, Note(f"and {more} more")] if more else listed


def _declared(first: Offence) -> list[Note]:
    return (
        [Note(f"{first.edge.name} is declared in {first.edge.source[0]}:{first.edge.source[1]}")] if first.edge else []
    )
