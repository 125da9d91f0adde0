"""What there is to say of owners that send nothing, nothing any more, or too seldom."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.findings import Finding, Note, finding

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tfcompose.catalogue import Severity
    from tfcompose.findings import Span
    from tfcompose.plan import PlanEdge

NAMED_AT_MOST = 6


def named(edges: Sequence[PlanEdge]) -> str:
    """Return the edges by name, the first few of them if they are many."""
    return first_of([edge.name for edge in edges])


def first_of(names: Sequence[str]) -> str:
    """Return the first few names, and how many more there are."""
    more = len(names) - NAMED_AT_MOST
    return ", ".join(names[:NAMED_AT_MOST]) + (f" and {more} more" if more > 0 else "")


def never_seen(edges: Sequence[PlanEdge], advice: str, place: Span | None = None) -> Finding:
    """Return the finding for edges of one owner that did not come; ``place`` is where the first stands."""
    first = edges[0]
    more = f" and {len(edges) - 1} more edge{'s' if len(edges) > 2 else ''}" if len(edges) > 1 else ""  # noqa: PLR2004 (one, or several)
    was, whose = ("were", "their") if more else ("was", "its")
    message = f"{first.name}{more} {was} never seen; {whose} owner is {_owner(first)}"
    return finding("TF811", message, place, notes=[] if place else _declared(edges), help=advice)


def silent(
    edges: Sequence[PlanEdge], quiet_s: float, place: Span | None = None, *, over: bool = False, gone: bool = False
) -> Finding:
    """Return the finding for edges of one owner that did not come for so long.

    ``over`` says that they came again after that, ``gone`` that the owner's publisher has left.
    """
    first = edges[0]
    what = "was silent" if over else "has left" if gone else "fell silent"
    message = f"{_owner(first)} {what}: nothing on {named(edges)} for {quiet_s:.3g} s"
    advice = f"is {first.node} still running, and does it get its data?"
    if gone:
        advice = f"start {first.node} again, and look why it ended"
    if over:
        advice = f"what held {first.node} up? An overloaded machine or network does, or a callback that blocks"
    return finding("TF804", message, place, notes=_rated(first, place), help=advice)


def left(edges: Sequence[PlanEdge], place: Span | None = None) -> Finding:
    """Return the finding for fixed edges whose owner has left."""
    return gone(_owner(edges[0]), [edge.name for edge in edges], place)


def gone(publisher: str, names: Sequence[str], place: Span | None = None) -> Finding:
    """Return the finding for fixed edges, by name, whose publisher has left."""
    message = f"{publisher} is gone: nobody latches {first_of(names)} any more"
    advice = "listeners that are there keep these frames; those that join later do not get them"
    return finding("TF804", message, place, help=advice)


def slow(edges: Sequence[PlanEdge], rate: float, place: Span | None = None, severity: Severity = "warning") -> Finding:
    """Return the finding for edges of one owner that come with ``rate`` hertz."""
    first = edges[0]
    come = "comes" if len(edges) == 1 else "come"
    message = f"{named(edges)} {come} at {rate:.3g} Hz from {_owner(first)}, declared are {first.rate or 0.0:g} Hz"
    notes = [] if place else _declared(edges[:1])
    return finding(
        "TF805", message, place, severity=severity, notes=notes, help="raise its rate, or declare the rate that it has"
    )


def _owner(edge: PlanEdge) -> str:
    return f"{edge.owner} ({edge.node})"


def _rated(edge: PlanEdge, place: Span | None) -> list[Note]:
    said = f"declared at {edge.rate:g} Hz" if edge.rate else "declared"
    if place:
        return [Note(said)] if edge.rate else []
    return [Note(f"{said} in {edge.source[0]}:{edge.source[1]}")] if edge.rate else []


def _declared(edges: Sequence[PlanEdge]) -> list[Note]:
    notes = [Note(f"{edge.name} is declared in {edge.source[0]}:{edge.source[1]}") for edge in edges[:NAMED_AT_MOST]]
    more = len(edges) - len(notes)
    return [*notes, Note(f"and {more} more")] if more else notes
