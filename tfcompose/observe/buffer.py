"""What is known of the live tree, as tf2 knows it: for each frame its parent, and poses over time.

Like tf2 (geometry2, ``BufferCore``) a frame has one parent, that of the newest sample; a leading slash is dropped;
self-transforms, empty names, values that are not finite and quaternions off unit length are refused; between two
samples positions are interpolated linearly and rotations on the great circle. Times are integer nanoseconds.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections import deque
from dataclasses import dataclass, field

from tfcompose.diagnostic import nearest
from tfcompose.pose import Pose, Quaternion, normalised

CACHE_NS = 10_000_000_000
#: tf2 refuses a quaternion whose squared length is off by this much.
DENORMALISED = 0.01


class TransformError(Exception):
    """Raised when there is no pose of one frame in another; the message says why."""


class LookupError(TransformError):  # noqa: A001 (tf2's name for it)
    """Raised when a frame is not known."""


class ConnectivityError(TransformError):
    """Raised when two frames are in two trees."""


class ExtrapolationError(TransformError):
    """Raised when the edges between two frames have no time in common."""


@dataclass(slots=True)
class _Edge:
    parent: str
    static: bool
    stamps: deque[int] = field(default_factory=deque)
    poses: deque[Pose] = field(default_factory=deque)

    def add(self, stamp_ns: int, pose: Pose) -> None:
        if self.static:
            self.stamps.clear()
            self.poses.clear()
        at = bisect_right(self.stamps, stamp_ns)
        if at and self.stamps[at - 1] == stamp_ns and not self.static:
            self.poses[at - 1] = pose
            return
        self.stamps.insert(at, stamp_ns)
        self.poses.insert(at, pose)
        while self.stamps[-1] - self.stamps[0] > CACHE_NS:
            self.stamps.popleft()
            self.poses.popleft()

    def pose_at(self, stamp_ns: int) -> Pose:
        if self.static or len(self.stamps) == 1:
            return self.poses[-1]
        at = min(max(bisect_right(self.stamps, stamp_ns), 1), len(self.stamps) - 1)
        before, after = self.stamps[at - 1], self.stamps[at]
        part = (stamp_ns - before) / (after - before)
        return interpolated(self.poses[at - 1], self.poses[at], min(max(part, 0.0), 1.0))


class Buffer:
    """Takes transforms and answers where one frame is in another."""

    def __init__(self) -> None:
        self._edges: dict[str, _Edge] = {}
        self._frames: set[str] = set()

    @property
    def frames(self) -> frozenset[str]:
        """Every frame that was heard of."""
        return frozenset(self._frames)

    def set(self, parent: str, child: str, pose: Pose, stamp_ns: int, *, static: bool) -> bool:
        """Take the pose of ``child`` in ``parent``; return False if tf2 would refuse it."""
        parent, child = parent.removeprefix("/"), child.removeprefix("/")
        if not parent or not child or parent == child or not _is_sound(pose):
            return False
        edge = self._edges.get(child)
        if edge is not None and edge.static == static and edge.stamps and not static:
            if stamp_ns < edge.stamps[-1] - CACHE_NS:
                return False
            if edge.parent != parent and stamp_ns < edge.stamps[-1]:
                return False  # an older sample does not decide the parent
        if edge is None or edge.static != static or edge.parent != parent:
            edge = self._edges[child] = _Edge(parent, static)
        edge.add(stamp_ns, Pose(pose.xyz, normalised(pose.quat_xyzw)))
        self._frames.update((parent, child))
        return True

    def latest(self, a: str, b: str) -> tuple[Pose, int | None]:
        """Return the pose of ``b`` in ``a`` at the newest time that all edges between them know, and that time.

        The time is in nanoseconds, or None where only fixed edges are on the way.

        Raises:
            LookupError: if a frame is not known.
            ConnectivityError: if they are in two trees.
            ExtrapolationError: if the edges have no time in common.
        """
        up, down = self._path(a.removeprefix("/"), b.removeprefix("/"))
        stamp = self._common_time([*up, *down])
        return self._down(up, stamp).inverse() @ self._down(down, stamp), stamp

    def behind(self, a: str, b: str) -> str | None:
        """Return the name of the moving edge between the two whose newest sample is the oldest, or None.

        Raises:
            LookupError: if a frame is not known.
            ConnectivityError: if they are in two trees.
        """
        up, down = self._path(a.removeprefix("/"), b.removeprefix("/"))
        moving = [child for child in (*up, *down) if not self._edges[child].static]
        if not moving:
            return None
        child = min(moving, key=lambda frame: self._edges[frame].stamps[-1])
        return f"{self._edges[child].parent} → {child}"

    def _path(self, a: str, b: str) -> tuple[list[str], list[str]]:
        """Return the frames from ``a`` up to below where the two meet, and those from ``b``."""
        for frame in (a, b):
            if frame not in self._frames:
                raise LookupError(self._unknown(frame))
        up_a, up_b = self._ancestors(a), self._ancestors(b)
        meeting = next((frame for frame in up_b if frame in up_a), None)
        if meeting is None:
            raise ConnectivityError(f"{a} and {b} are in two trees: one begins at {up_a[-1]}, the other at {up_b[-1]}")
        return up_a[: up_a.index(meeting)], up_b[: up_b.index(meeting)]

    def _unknown(self, frame: str) -> str:
        near = nearest(frame, sorted(self._frames))
        return (
            f"no frame {frame}; did you mean {near}?" if near else f"no frame {frame} among {len(self._frames)} frames"
        )

    def _ancestors(self, frame: str) -> list[str]:
        chain = [frame]
        while frame in self._edges:
            frame = self._edges[frame].parent
            if frame in chain:
                loop = " → ".join([*reversed(chain[chain.index(frame) :]), chain[-1]])
                raise ConnectivityError(f"the live tree has a loop: {loop}")
            chain.append(frame)
        return chain

    def _common_time(self, children: list[str]) -> int | None:
        moving = [(child, self._edges[child]) for child in children if not self._edges[child].static]
        if not moving:
            return None
        oldest = min(moving, key=lambda item: item[1].stamps[-1])
        stamp = oldest[1].stamps[-1]
        for child, edge in moving:
            if edge.stamps[0] > stamp:
                ahead_ms = (edge.stamps[0] - stamp) / 1e6
                message = (
                    f"{edge.parent} → {child} begins {ahead_ms:.0f} ms after the last of "
                    f"{oldest[1].parent} → {oldest[0]}: they have no time in common"
                )
                raise ExtrapolationError(message)
        return stamp

    def _down(self, children: list[str], stamp_ns: int | None) -> Pose:
        """Return the pose of the first frame in the parent of the last."""
        pose = Pose()
        for child in children:
            pose = self._edges[child].pose_at(stamp_ns or 0) @ pose
        return pose


def interpolated(a: Pose, b: Pose, part: float) -> Pose:
    """Return the pose that is ``part`` (0 to 1) of the way from ``a`` to ``b``: linear, and spherical for rotations."""
    x, y, z = (p + (q - p) * part for p, q in zip(a.xyz, b.xyz, strict=True))
    return Pose((x, y, z), _slerp(a.quat_xyzw, b.quat_xyzw, part))


def _slerp(a: Quaternion, b: Quaternion, part: float) -> Quaternion:
    dot = math.fsum(p * q for p, q in zip(a, b, strict=True))
    sign, dot = (-1.0, -dot) if dot < 0 else (1.0, dot)
    angle = math.acos(min(dot, 1.0))
    if angle < 1e-6:  # noqa: PLR2004 (the chord and the arc agree to the last bit)
        weights = 1 - part, part
    else:
        weights = math.sin((1 - part) * angle) / math.sin(angle), math.sin(part * angle) / math.sin(angle)
    x, y, z, w = (weights[0] * p + sign * weights[1] * q for p, q in zip(a, b, strict=True))
    return normalised((x, y, z, w))


def _is_sound(pose: Pose) -> bool:
    if not all(math.isfinite(value) for value in (*pose.xyz, *pose.quat_xyzw)):
        return False
    return abs(math.fsum(value * value for value in pose.quat_xyzw) - 1) < DENORMALISED
