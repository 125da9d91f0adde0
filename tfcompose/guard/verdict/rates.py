"""Findings about rates: edges that never arrived, stopped, are slow, or have gaps."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

from tfcompose.foundation.findings import Finding, Note, finding
from tfcompose.foundation.text import duration, list_names, with_more
from tfcompose.model.plan import silent_after_s
from tfcompose.tf.live.arrivals import KEPT_NS
from tfcompose.tf.live.state import who

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from tfcompose.foundation.catalogue import Severity
    from tfcompose.foundation.findings import Span
    from tfcompose.model.plan import PlanEdge
    from tfcompose.tf.live.edges import EdgeState
    from tfcompose.tf.live.state import TreeState

#: Minimum rates in Hz of edges that navigation looks up for each scan and each control step (as in
#: TF307), by frame names.
LEAST = {("odom", "base_link"): 20.0, ("odom", "base_footprint"): 20.0, ("map", "odom"): 5.0}
#: Minimum rate in Hz of any other edge with edges below it.
LEAST_INSIDE = 5.0
#: Fraction of the minimum rate to accept. A timer of 20 Hz sends a little less often than 20 Hz.
NEARLY = 0.9
#: Minimum number of messages to judge a rate.
FEWEST = 3
#: A gap counts if it exceeds the other gaps by this factor, and exceeds this many seconds.
GAP, GAP_S = 10.0, 1.0
#: A low rate is certain after this time, in seconds.
SURE_S = 1.0
NAMED_AT_MOST = 6


# Edges of a plan; ``span`` is the first edge's place in the robot file.


def never_received_finding(
    edges: Sequence[PlanEdge], advice: str, span: Span | None = None
) -> Finding:
    """Return the finding for edges of an owner that never arrived."""
    are_many = len(edges) > 1
    named = with_more(edges[0].name, len(edges) - 1)
    message = (
        f"{named} {'were' if are_many else 'was'} never received; {'their' if are_many else 'its'}"
        " owner is "
    )
    return finding(
        "TF811",
        message + _owner(edges[0]),
        span,
        notes=[] if span else _declared_notes(edges),
        help=advice,
    )


def silent(
    edges: Sequence[PlanEdge],
    silence_s: float,
    span: Span | None = None,
    *,
    over: bool = False,
    gone: bool = False,
) -> Finding:
    """Return the finding for edges of an owner that did not arrive for ``silence_s`` seconds.

    ``over``: the edges have arrived again since. ``gone``: the owner's publisher has left.
    """
    first = edges[0]
    names = [edge.name for edge in edges]
    return _silence(
        _owner(first),
        first.node,
        names,
        silence_s,
        span,
        over=over,
        gone=gone,
        notes=_rate_notes(first, span),
    )


def owner_left(edges: Sequence[PlanEdge], span: Span | None = None) -> Finding:
    """Return the finding for fixed edges whose owner has left."""
    return _unlatched_finding(_owner(edges[0]), [edge.name for edge in edges], span)


def slow(
    edges: Sequence[PlanEdge],
    rate: float,
    span: Span | None = None,
    severity: Severity = "warning",
) -> Finding:
    """Return the finding for edges of an owner that arrive at ``rate`` Hz."""
    first = edges[0]
    come = "comes" if len(edges) == 1 else "come"
    named = list_names([edge.name for edge in edges])
    message = (
        f"{named} {come} at {rate:.3g} Hz from {_owner(first)}, but {first.rate or 0.0:g} Hz is"
        " declared"
    )
    notes = [] if span else _declared_notes(edges[:1])
    advice = "raise its rate, or declare the rate that it has"
    return finding("TF805", message, span, severity=severity, notes=notes, help=advice)


def _silence(  # noqa: PLR0913 (a finding has that many parts; the others are named)
    publisher: str,
    node: str,
    names: Sequence[str],
    silence_s: float,
    span: Span | None = None,
    *,
    over: bool = False,
    gone: bool = False,
    notes: Sequence[Note] = (),
) -> Finding:
    what = "was silent" if over else "has left" if gone else "fell silent"
    message = f"{publisher} {what}: nothing on {list_names(names)} for {duration(silence_s)}"
    advice = f"is {node} still running, and does it get its data?"
    if gone:
        advice = f"start {node} again, and find out why it ended"
    if over:
        advice = (
            f"what held {node} up? An overloaded machine or network does, or a callback that"
            " blocks"
        )
    return finding("TF804", message, span, notes=notes, help=advice)


def _unlatched_finding(publisher: str, names: Sequence[str], span: Span | None = None) -> Finding:
    message = f"{publisher} has left: no node latches {list_names(names)} any more"
    advice = "current listeners keep these frames; later ones do not get them"
    return finding("TF804", message, span, help=advice)


def _owner(edge: PlanEdge) -> str:
    return f"{edge.owner} ({edge.node})"


def _rate_notes(edge: PlanEdge, span: Span | None) -> list[Note]:
    if not edge.rate:
        return []
    declared = f"declared at {edge.rate:g} Hz"
    return [Note(declared if span else f"{declared} in {edge.source[0]}:{edge.source[1]}")]


def _declared_notes(edges: Sequence[PlanEdge]) -> list[Note]:
    notes = [
        Note(f"{edge.name} is declared in {edge.source[0]}:{edge.source[1]}")
        for edge in edges[:NAMED_AT_MOST]
    ]
    more = len(edges) - len(notes)
    return [*notes, Note(f"and {more} more")] if more else notes


# Edges without a rate in a plan.


def low_rate(state: TreeState) -> Iterator[Finding]:
    """An edge arrives so rarely that lookups between two messages fail and frames jump."""
    inside, rated = {edge.parent for edge in state.taken}, state.rated
    for edge in state.moving:
        rate, least = edge.timing.rate, least_of(edge, inside) * _speed(state, edge)
        if (
            edge.child in rated
            or rate is None
            or rate >= NEARLY * least
            or is_silent(edge)
            or _has_gap(edge)
        ):
            continue
        if edge.stream.arrivals.count < FEWEST and state.seconds < 2 * SURE_S:
            continue
        often = f"{rate:.2g} Hz" if rate < least / 2 else f"{rate:.3g} Hz"
        message = (
            f"{edge.name} comes at {often} from {who(edge)}; it needs at least {least:.3g} Hz"
        )
        notes = [
            Note(
                f"in the {duration(1 / rate)} between messages, lookups at the current time"
                " extrapolate into the future"
            )
        ]
        advice = (
            "raise its rate: publish_rate, publish_frequency, frequency, transform_publish_period"
        )
        yield finding("TF838", message, None, severity="warning", notes=notes, help=advice)


def gap(state: TreeState) -> Iterator[Finding]:
    """An edge with a high rate has a pause."""
    rated = state.rated
    parents = Counter(child for _, child in {(edge.parent, edge.child) for edge in state.moving})
    for edge in state.moving:
        if not _has_gap(edge) or edge.child in rated or parents[edge.child] > 1:
            continue
        rate, longest = edge.timing.rate or 0.0, edge.timing.longest_gap_s or 0.0
        message = (
            f"{edge.name} from {who(edge)} was missing for {duration(longest)}; otherwise it comes"
            f" at {rate:.3g} Hz"
        )
        advice = (
            "is its computer, or the network, overloaded? A node that blocks in a callback sends"
            " nothing meanwhile"
        )
        yield finding("TF839", message, None, severity="warning", help=advice)


def fell_silent(state: TreeState) -> Iterator[Finding]:
    """An edge arrived, but has stopped."""
    alive = {(edge.parent, edge.child) for edge in state.moving if not is_silent(edge)}
    elsewhere = {edge.child for edge in state.moving if not is_silent(edge)}
    rated = state.rated
    for edge in state.moving:
        if not is_silent(edge) or edge.child in rated or (edge.parent, edge.child) in alive:
            continue
        if edge.child in elsewhere and edge.present is not False:
            # The frame has another parent now, which is correct or another finding.
            continue
        yield _silence(who(edge), who(edge), [edge.name], edge.age_s, gone=edge.present is False)


def find_fixed_left(state: TreeState) -> Iterator[Finding]:
    """Fixed edges arrived, but the publisher that latched them has left."""
    held = {edge.child for edge in state.taken if edge.stream.static and edge.present is not False}
    held |= state.planned
    lost: dict[str, list[EdgeState]] = {}
    for edge in state.taken:
        child = edge.child
        if edge.stream.static and edge.present is False and child not in held:
            lost.setdefault(who(edge), []).append(edge)
    for publisher, edges in lost.items():
        yield _unlatched_finding(publisher, [edge.name for edge in edges])


def _speed(state: TreeState, edge: EdgeState) -> float:
    """Return the real-time factor of a simulated edge, at most 1. It reduces expected rates."""
    clock_ns = state.clock_ns
    ruled = clock_ns is not None and abs(edge.stream.stamp_ns - clock_ns) <= KEPT_NS
    return min(1.0, edge.stream.speed) if ruled else 1.0


def least_of(edge: EdgeState, inside: set[str]) -> float:
    """Return the minimum rate of an edge in Hz, 0 without one."""
    stream = edge.stream
    named = LEAST.get((stream.parent.rpartition("/")[2], stream.child.rpartition("/")[2]))
    return named or (LEAST_INSIDE if stream.child in inside else 0.0)


def is_silent(edge: EdgeState) -> bool:
    """Return whether a moving edge has stopped after a steady rate."""
    count = edge.stream.arrivals.count
    span_s = (edge.stream.arrivals.last_ns - edge.stream.first_ns) / 1e9
    period_s = span_s / (count - 1) if count >= FEWEST else float("inf")
    return edge.age_s > silent_after_s(period_s)


def _has_gap(edge: EdgeState) -> bool:
    rate, longest = edge.timing.rate, edge.timing.longest_gap_s
    if rate is None or longest is None or edge.stream.arrivals.count < FEWEST:
        return False
    return longest >= GAP_S and longest * rate >= GAP
