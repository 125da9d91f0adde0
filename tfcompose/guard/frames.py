"""Frames of the guarded tree: the parent of each frame, and its latest senders.

Senders distinguish alternating publishers from a restarted publisher. Parents reveal loops.
"""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass
from typing import TYPE_CHECKING

from tfcompose.foundation.tree import loop_closed_by

if TYPE_CHECKING:
    from collections.abc import Mapping

    from tfcompose.model.plan import Plan

#: tf2 buffers keep moving edges for 10 s. An edge that has not arrived for this time closes no
#: loop.
KEPT_S = 10.0
#: Maximum number of frames without a planned parent to remember.
MOST_FRAMES = 10_000
#: Maximum number of senders of a frame to remember.
MOST_SENDERS = 16
#: Maximum number of edges to follow upwards in search of a loop, so that a chain of thousands
#: costs a bounded time. No robot is this deep.
DEEPEST_LOOP = 100


@dataclass(slots=True)
class Frame:
    """A child frame: its parent, its last arrival, and its senders, the newest last."""

    parent: str
    last: float
    senders: tuple[bytes, ...] = ()


class Frames:
    """Child frames by name: frames of the plan and other received frames."""

    def __init__(self, plan: Plan) -> None:
        self._planned = {edge.child: Frame(edge.parent, float("inf")) for edge in plan.edges}
        self._others: OrderedDict[str, Frame] = OrderedDict()

    def attach(self, parent: str, child: str, now: float, *, static: bool) -> bool:
        """Record an edge that is not planned; return whether it changes the tree."""
        frame = self._others.get(child) or Frame("", 0.0)
        is_new = frame.parent != parent
        frame.parent, frame.last = parent, float("inf") if static else now
        self._others[child] = frame
        self._others.move_to_end(child)
        if len(self._others) > MOST_FRAMES:
            self._others.popitem(last=False)
        return is_new

    def take_sender(self, child: str, gid: bytes) -> tuple[bytes, bool]:
        """Record the frame's sender. Return the previous sender, and whether ``gid`` alternates.

        A publisher alternates if another publisher has sent the frame since its own last message.
        """
        frame = self._planned.get(child) or self._others[child]
        senders = frame.senders or (gid,)
        current = senders[-1]
        if current != gid:
            earlier = tuple(sender for sender in senders if sender != gid)
            frame.senders = (*earlier, gid)[-MOST_SENDERS:]
        else:
            frame.senders = senders
        return current, current != gid and gid in senders

    def current_sender(self, child: str) -> bytes | None:
        """Return the last sender of a planned frame, None without a sender."""
        senders = self._planned[child].senders if child in self._planned else ()
        return senders[-1] if senders else None

    def forget_senders(self, child: str) -> None:
        """Treat the next sender of the planned frame as its first."""
        self._planned[child].senders = ()

    def loop(self, parent: str, child: str, now: float) -> tuple[str, ...]:
        """Return the frames of the loop that the edge closes, from ``child`` down to ``child``."""
        left = iter(range(DEEPEST_LOOP))
        return loop_closed_by(
            (parent, child),
            lambda name: None if next(left, None) is None else self._parent(name, now),
        )

    def is_planned(self, parent: str, child: str) -> bool:
        """Return whether the plan has this edge."""
        return child in self._planned and self._planned[child].parent == parent

    def _parent(self, name: str, now: float) -> str | None:
        frame = self._planned.get(name) or self._others.get(name)
        return frame.parent if frame and now - frame.last < KEPT_S else None

    def memory(self) -> dict[str, tuple[str, ...]]:
        """Return the state for a new guard: senders of planned frames, in hexadecimal."""
        return {
            child: tuple(gid.hex() for gid in frame.senders)
            for child, frame in self._planned.items()
            if frame.senders
        }

    def recall(self, memory: Mapping[str, tuple[str, ...]]) -> None:
        """Restore the senders that the previous guard knew."""
        for child, senders in memory.items():
            if child in self._planned:
                self._planned[child].senders = tuple(map(bytes.fromhex, senders))
