"""What there is to say of transforms that tf2 drops."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.diagnostic import Diagnostic, finding
from tfcompose.observe.refusal import Refusal
from tfcompose.observe.seen import who

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.observe.census import EdgeSeen


def refused_transform(edge: EdgeSeen) -> Iterator[Diagnostic]:
    """Give the finding for an edge of which tf2 drops transforms, unless it is a frame in itself."""
    strand = edge.strand
    if strand.refused is None or strand.refused is Refusal.SELF:
        return
    why = strand.refused.text
    if strand.refused is Refusal.DENORMALISED:
        length = sum(part * part for part in strand.pose.quat_xyzw) ** 0.5
        why = f"its quaternion has length {length:.3f}"
    name = f"{strand.parent or '(no frame)'} → {strand.child or '(no frame)'}"
    often = "" if strand.static else f" ({strand.refusals} of {strand.tally.count})"
    message = f"{who(edge)} publishes {name}, which tf2 drops: {why}{often}"
    yield finding("TF831", message, None, help="mend what the node computes it from; until then the frame is not there")
