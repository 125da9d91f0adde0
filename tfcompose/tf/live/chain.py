"""The published edges between two frames, and the age of the newest pose."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from tfcompose.tf.tf2.exceptions import UnknownFrame, two_trees

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tfcompose.tf.live.edges import EdgeState


@dataclass(frozen=True, slots=True)
class Delay:
    """Age of an edge's newest stamp just before the next message arrives, in seconds.

    It is given as mean and maximum.
    """

    edge: EdgeState
    mean_s: float
    most_s: float


@dataclass(frozen=True, slots=True)
class FrameChain:
    """The frames from A to B, and their edges."""

    frames: tuple[str, ...]
    #: For each frame, the edge with the newest message, in the order of the frames.
    newest: tuple[EdgeState, ...]
    #: The edges of all publishers, in the order of the frames.
    all_edges: tuple[EdgeState, ...]

    @property
    def delay(self) -> Delay | None:
        """The delay of the edge that lags most, which determines the pose.

        None if no edge moves.
        """
        delays = [delay for edge in self.newest if (delay := _delay(edge))]
        return max(delays, key=lambda delay: delay.mean_s, default=None)


def chain_between(edges: Sequence[EdgeState], a: str, b: str) -> FrameChain | str:
    """Return the chain between two frames, or the reason why there is none.

    If a frame has several publishers, the newest message counts, as in tf2, unless tf2 rejects it.
    """
    by_child: dict[str, list[EdgeState]] = {}
    for edge in edges:
        if edge.stream.rejections == edge.stream.arrivals.count:
            continue
        by_child.setdefault(edge.child, []).append(edge)
    for rivals in by_child.values():
        rivals.sort(key=lambda edge: (edge.present is False, -edge.stream.arrivals.last_ns))
    frames = {*by_child, *(edge.parent for rivals in by_child.values() for edge in rivals)}
    unknown = next((frame for frame in (a, b) if frame not in frames), None)
    if unknown is not None:
        return str(UnknownFrame(unknown, sorted(frames)))
    above_a, above_b = _above(by_child, a), _above(by_child, b)
    common = next((frame for frame in above_a if frame in above_b), None)
    if common is None:
        return two_trees((), a, b, above_a[-1], above_b[-1])
    up, down = above_a[: above_a.index(common)], above_b[: above_b.index(common)][::-1]
    some = [by_child[child] for child in (*up, *down)]
    newest = tuple(rivals[0] for rivals in some)
    return FrameChain(
        (*up, common, *down), newest, tuple(edge for rivals in some for edge in rivals)
    )


def _above(by_child: dict[str, list[EdgeState]], frame: str) -> list[str]:
    """Return the frame and its ancestors up to the root. Frames of a loop occur once."""
    frames = [frame]
    while frame in by_child and (frame := by_child[frame][0].parent) not in frames:
        frames.append(frame)
    return frames


def _delay(edge: EdgeState) -> Delay | None:
    if edge.data_age_s is None:
        return None
    timing = edge.timing
    if timing.delay_s is None or timing.most_delay_s is None or not timing.rate:
        return Delay(edge, edge.data_age_s, edge.data_age_s)
    return Delay(
        edge,
        timing.delay_s + 0.5 / timing.rate,
        timing.most_delay_s + (timing.longest_gap_s or 0.0),
    )
