"""Requested poses of one frame in another, live or from a bag, and why not."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

    from tfcompose.foundation.geometry import Pose
    from tfcompose.tf.tf2 import Buffer

    #: Is given each pose, with its time in nanoseconds; None: all edges are fixed.
    OnPose = Callable[[Pose, int | None], None]


@dataclass(frozen=True, slots=True)
class PoseQuery:
    """Which poses to give: of ``source`` in ``target``; once, or ``rate`` times a second.

    ``timeout_s`` without a new one ends it. ``at_ns`` is the time of the pose, in nanoseconds
    since the epoch; from 0 down it is counted from the newest. ``topics`` are those of moving and
    of fixed edges.
    """

    target: str
    source: str
    once: bool
    rate: float
    timeout_s: float
    topics: tuple[str, str]
    at_ns: int = 0

    def pose_in(self, buffer: Buffer) -> tuple[Pose, int | None]:
        """Return the pose with its time in nanoseconds; None: all edges are fixed.

        Raises:
            TransformException: if there is none.
        """
        if self.at_ns > 0:
            return buffer.lookup(self.target, self.source, self.at_ns)
        pose, stamp_ns = buffer.latest(self.target, self.source)
        if not stamp_ns or not self.at_ns:
            return pose, stamp_ns
        return buffer.lookup(self.target, self.source, stamp_ns + self.at_ns)


@dataclass(frozen=True, slots=True)
class NoPose:
    """Why there was no pose, and what to do about it, where more is known than the reason says.

    ``elsewhere`` are other topics on which there is TF, where nothing came; None: something did.
    """

    reason: str
    help: str = ""
    elsewhere: tuple[str, ...] | None = None
