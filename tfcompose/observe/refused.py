"""What there is to say of transforms that tf2 drops."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.findings import Finding, finding
from tfcompose.observe.seen import who
from tfcompose.tf2.exceptions import Rejection

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.observe.census import EdgeSeen

_ZERO = 1e-9
_MEND = "mend what the node computes it from; until then the frame is not there"
_MEND_SOME = "mend what the node computes it from; tf2 goes on with those before and after"
_NORMALISE = (
    "bring it to length 1 in the node: RViz shows the frame all the same, since tf2 on Jazzy does so when it takes it, "
    "but stricter readers drop it"
)


def refused_transform(edge: EdgeSeen) -> Iterator[Finding]:
    """Give the finding for an edge of which tf2 drops transforms, unless it is a frame in itself."""
    strand = edge.strand
    if strand.refused is None or strand.refused is Rejection.SELF:
        return
    what, why, advice = "which tf2 drops", strand.refused.text, _MEND
    if strand.refusals < strand.tally.count:
        advice = _MEND_SOME
    length = sum(part * part for part in (strand.refused_row or strand.row)[7:11]) ** 0.5
    if strand.refused is Rejection.DENORMALISED:
        why = f"its quaternion has length {length:.3f}"
        if length > _ZERO:
            what, advice = "which is no rotation", _NORMALISE
    name = f"{strand.parent or '(no frame)'} → {strand.child or '(no frame)'}"
    often = "" if strand.static else f" ({strand.refusals} of {strand.tally.count})"
    message = f"{who(edge)} publishes {name}, {what}: {why}{often}"
    yield finding("TF831", message, None, help=advice)
