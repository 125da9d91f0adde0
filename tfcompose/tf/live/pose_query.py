"""Requested poses of a frame in another frame, live or from a bag, and the reason if missing."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

    from tfcompose.foundation.geometry import Pose
    from tfcompose.tf.tf2 import Buffer

    #: Receives each pose with its time in nanoseconds, None if all edges are fixed.
    OnPose = Callable[[Pose, int | None], None]


@dataclass(frozen=True, slots=True)
class PoseQuery:
    """A request for poses of a frame in another frame."""

    #: The reference frame.
    target: str
    #: The frame whose pose is returned.
    source: str
    once: bool
    #: Poses per second, unless ``once``.
    rate: float
    #: The query ends after this time without a new pose, in seconds.
    timeout_s: float
    #: The topics of moving and of fixed edges.
    topics: tuple[str, str]
    #: Time of the pose in nanoseconds since the epoch. If it is 0 or negative, it is relative to
    #: the newest pose.
    at_ns: int = 0

    def pose_in(self, buffer: Buffer) -> tuple[Pose, int | None]:
        """Return the pose with its time in nanoseconds, None if all edges are fixed.

        Raises:
            TransformException: if there is no pose.
        """
        if self.at_ns > 0:
            return buffer.lookup(self.target, self.source, self.at_ns)
        pose, stamp_ns = buffer.latest(self.target, self.source)
        if not stamp_ns or not self.at_ns:
            return pose, stamp_ns
        return buffer.lookup(self.target, self.source, stamp_ns + self.at_ns)


@dataclass(frozen=True, slots=True)
class NoPose:
    """The reason for a missing pose, and advice if available."""

    reason: str
    help: str = ""
    #: Other topics with TF if no message arrived on these topics, None if messages arrived.
    elsewhere: tuple[str, ...] | None = None
