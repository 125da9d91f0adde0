"""What is wrong with how often edges come."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

from tfcompose.findings import Finding, Note, finding
from tfcompose.observe.seen import who
from tfcompose.verdict.clock import WRONG_BY_NS, seconds
from tfcompose.verdict.timing import gone

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.observe.census import EdgeSeen
    from tfcompose.observe.seen import Seen

#: Least rates in Hz of what navigation looks up for every scan and every control step (as for TF307), by frame names.
LEAST = {("odom", "base_link"): 20.0, ("odom", "base_footprint"): 20.0, ("map", "odom"): 5.0}
#: Any edge that others hang on.
LEAST_INSIDE = 5.0
#: A timer of 20 Hz sends a little less than 20 Hz.
NEARLY = 0.9
#: So many messages say how often something comes.
FEWEST = 3
#: A gap that is longer by this factor than the others, and than so many seconds.
GAP, GAP_S = 10.0, 1.0
#: Of a low rate one is sure after so long.
SURE_S = 1.0
#: Somebody is silent after four of his periods, and this time at least.
PERIODS, SILENT_S = 4.0, 0.6


def low_rate(seen: Seen) -> Iterator[Finding]:
    """An edge comes so seldom that lookups fail between two messages, and frames jump."""
    inside, rated = {edge.strand.parent for edge in seen.taken}, seen.rated
    for edge in seen.moving:
        rate, least = edge.timing.rate, least_of(edge, inside) * _speed(seen, edge)
        if edge.strand.child in rated or rate is None or rate >= NEARLY * least or is_silent(edge) or _has_gap(edge):
            continue
        if edge.strand.tally.count < FEWEST and seen.seconds < 2 * SURE_S:
            continue
        often = f"{rate:.2g} Hz" if rate < least / 2 else f"{rate:.3g} Hz"
        message = f"{edge.name} comes with {often} from {who(edge)}, and should with {least:.3g} Hz or more"
        notes = [Note(f"between two messages, {seconds(1 / rate)}, lookups of now are extrapolation into the future")]
        advice = "raise its rate: publish_rate, publish_frequency, frequency, transform_publish_period"
        yield finding("TF838", message, None, severity="warning", notes=notes, help=advice)


def gap(seen: Seen) -> Iterator[Finding]:
    """An edge comes often, and then not at all for a while."""
    rated = seen.rated
    parents = Counter(child for _, child in {(edge.strand.parent, edge.strand.child) for edge in seen.moving})
    for edge in seen.moving:
        if not _has_gap(edge) or edge.strand.child in rated or parents[edge.strand.child] > 1:
            continue
        rate, longest = edge.timing.rate or 0.0, edge.timing.longest_gap_s or 0.0
        message = f"{edge.name} from {who(edge)} stayed away for {seconds(longest)}, and comes with {rate:.3g} Hz else"
        advice = "is its computer, or the network, overloaded? A node that blocks in a callback sends nothing meanwhile"
        yield finding("TF839", message, None, severity="warning", help=advice)


def fell_silent(seen: Seen) -> Iterator[Finding]:
    """An edge came, and does not come any more."""
    alive = {(edge.strand.parent, edge.strand.child) for edge in seen.moving if not is_silent(edge)}
    elsewhere = {edge.strand.child for edge in seen.moving if not is_silent(edge)}
    rated = seen.rated
    for edge in seen.moving:
        if not is_silent(edge) or edge.strand.child in rated or (edge.strand.parent, edge.strand.child) in alive:
            continue
        if edge.strand.child in elsewhere and edge.present is not False:
            continue  # the frame hangs on another parent now, which is a finding of its own, or right
        gone = ", which has left" if edge.present is False else ", which is still there"
        message = f"{edge.name}: nothing for {seconds(edge.age_s)} from {who(edge)}{gone}"
        advice = "start it again, and look why it ended" if edge.present is False else "what does it wait for?"
        yield finding("TF804", message, None, help=advice)


def fixed_left(seen: Seen) -> Iterator[Finding]:
    """Fixed edges were there, and the publisher that held them for those who come later has left."""
    held = {edge.strand.child for edge in seen.taken if edge.strand.static and edge.present is not False}
    held |= seen.planned
    lost: dict[str, list[EdgeSeen]] = {}
    for edge in seen.taken:
        child = edge.strand.child
        if edge.strand.static and edge.present is False and child not in held:
            lost.setdefault(who(edge), []).append(edge)
    for publisher, edges in lost.items():
        yield gone(publisher, [edge.name for edge in edges])


def _speed(seen: Seen, edge: EdgeSeen) -> float:
    """Return how fast simulated time goes by, 1 at most: so much less often may come what it rules."""
    clock_ns = seen.clock_ns
    ruled = clock_ns is not None and abs(edge.strand.stamp_ns - clock_ns) <= WRONG_BY_NS
    return min(1.0, edge.strand.speed) if ruled else 1.0


def least_of(edge: EdgeSeen, inside: set[str]) -> float:
    """Return the least rate of an edge in hertz; 0 where any will do."""
    strand = edge.strand
    named = LEAST.get((strand.parent.rpartition("/")[2], strand.child.rpartition("/")[2]))
    return named or (LEAST_INSIDE if strand.child in inside else 0.0)


def is_silent(edge: EdgeSeen) -> bool:
    """Whether a moving edge that came often does not come any more."""
    count, tally = edge.strand.tally.count, edge.strand.tally
    span_s = (tally.last_ns - edge.strand.first_ns) / 1e9
    period_s = span_s / (count - 1) if count >= FEWEST else float("inf")
    return edge.age_s > max(SILENT_S, PERIODS * period_s)


def _has_gap(edge: EdgeSeen) -> bool:
    rate, longest = edge.timing.rate, edge.timing.longest_gap_s
    if rate is None or longest is None or edge.strand.tally.count < FEWEST:
        return False
    return longest >= GAP_S and longest * rate >= GAP
