"""The buffer without messages: accepts transforms as plain numbers, and returns poses.

Frames are names, times are integer nanoseconds since the epoch, and poses are
``tfcompose.foundation.geometry.Pose``.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite, sqrt
from threading import Condition, RLock
from typing import TYPE_CHECKING

from tfcompose.foundation.geometry import Pose
from tfcompose.tf.tf2 import exceptions
from tfcompose.tf.tf2.cache import (
    PoseChain,
    TimeCache,
    chain_at,
    newest_chain,
    no_common_time,
    pack_pose,
)
from tfcompose.tf.tf2.exceptions import (
    ConnectivityException,
    ExtrapolationException,
    LookupException,
    Rejection,
    TransformException,
    rejection_of,
)
from tfcompose.tf.tf2.poses import IDENTITY, PoseTuple, product, unit

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

#: Time in nanoseconds for which samples are kept before the newest sample of their edge, as in
#: tf2.
CACHE_NS = 10_000_000_000
# A sum of four squares within this distance of 1 equals 1 within rounding.
_ROUNDING = 1e-15
# Maximum number of remembered chains.
_MOST_CHAINS = 4096
_SECOND_NS = 1_000_000_000

#: A transform: parent, child, seconds, nanoseconds, x y z in metres, quaternion x y z w.
Row = tuple[str, str, int, int, float, float, float, float, float, float, float]


@dataclass(frozen=True, slots=True)
class FrameInfo:
    """A frame's edge to its parent.

    Times are in nanoseconds since the epoch. They are 0 for a fixed edge, which is valid at any
    time.
    """

    name: str
    #: The parent; empty for a root, and for a moving frame after ``clear``.
    parent: str
    static: bool
    #: The sender, as given to ``set`` or ``insert``.
    authority: str
    oldest_ns: int
    newest_ns: int
    #: Number of kept samples.
    samples: int


class PoseBuffer:
    """Accepts transforms and returns the pose of a frame in another frame. Thread-safe.

    Args:
        cache_ns: how long samples are kept, in nanoseconds before the newest of their edge.

    Raises:
        ValueError: if the time is negative.
    """

    def __init__(self, cache_ns: int = CACHE_NS) -> None:
        if cache_ns < 0:
            raise ValueError(f"samples cannot be kept for {cache_ns} ns")
        self.cache_ns = cache_ns
        self._lock = RLock()
        self._inserted = Condition(self._lock)
        self._waiting = 0
        #: Functions to call after an insertion, in the inserting thread.
        self.on_insert: list[Callable[[], object]] = []
        self._caches: dict[str, TimeCache] = {}
        self._names: dict[str, None] = {}
        #: Rises with each new frame, changed fixed pose and changed parent.
        self.revision = 0
        self._chains: dict[tuple[str, str], PoseChain] = {}
        self._mixed: set[str] = set()

    @property
    def frames(self) -> frozenset[str]:
        """Every known frame."""
        with self._lock:
            return frozenset(self._names)

    def set(  # noqa: PLR0913 (a transform has that many parts)
        self,
        parent: str,
        child: str,
        pose: Pose,
        stamp_ns: int,
        *,
        static: bool,
        authority: str = "",
    ) -> bool:
        """Insert the pose of ``child`` in ``parent``. Return False if tf2 would reject it."""
        row = (parent, child, 0, stamp_ns, *pose.xyz, *pose.quat_xyzw)
        return not self.insert([row], static=static, authority=authority)

    def insert(
        self, rows: Iterable[Row], *, static: bool, authority: str = ""
    ) -> list[tuple[str, Rejection]]:
        """Insert transforms in order. Return the child and the reason for each rejected transform.

        A leading slash is removed from names, and quaternions are normalised. ``Rejection`` lists
        the reasons, in the words of tf2's log. Infinite values count as NaN.
        """
        rejected: list[tuple[str, Rejection]] = []
        with self._lock:
            caches, cache_ns = self._caches, self.cache_ns
            for row in rows:
                # The hot path, taken fifty thousand times a second: another sample of a known
                # edge.
                parent, child, sec, nsec, x, y, z, qx, qy, qz, qw = row
                cache = caches.get(child)
                if cache is not None and cache.parent == parent and cache.static is static:
                    squared = qx * qx + qy * qy + qz * qz + qw * qw
                    if -_ROUNDING < squared - 1.0 < _ROUNDING and isfinite(x + y + z):
                        pose = pack_pose(x, y, z, qx, qy, qz, qw)
                        if cache.append(sec * _SECOND_NS + nsec, pose, cache_ns):
                            cache.authority = authority
                            continue
                reason = self._take(row, static=static, authority=authority)
                if reason:
                    rejected.append((child.removeprefix("/"), reason))
            if self._waiting:
                self._inserted.notify_all()
        if self.on_insert:
            for callback in tuple(self.on_insert):
                callback()
        return rejected

    def _take(self, row: Row, *, static: bool, authority: str) -> Rejection | None:
        """Insert any transform. Return the reason if it is rejected."""
        # tf2 strips a single slash.
        parent, child = row[0].removeprefix("/"), row[1].removeprefix("/")
        x, y, z, qx, qy, qz, qw = row[4:]
        reason = rejection_of(parent, child, (x, y, z, qx, qy, qz, qw))
        if reason:
            return reason
        squared = qx * qx + qy * qy + qz * qz + qw * qw
        scale = 1.0 if -_ROUNDING < squared - 1.0 < _ROUNDING else 1 / sqrt(squared)
        cache = self._caches.get(child)
        if cache is None or cache.static is not static:
            cache = self._new_cache(child, static=static)
        pose = (x, y, z, qx * scale, qy * scale, qz * scale, qw * scale)
        outcome = cache.insert(row[2] * _SECOND_NS + row[3], parent, pose, self.cache_ns)
        if outcome != "taken" or cache.mixed:
            self._names.setdefault(child)
            self._names.setdefault(parent)
        if outcome == "old":
            return Rejection.OLD
        if outcome == "changed":
            self._forget_chains(cache)
        cache.authority = authority
        return None

    def lookup(self, target: str, source: str, stamp_ns: int = 0) -> tuple[Pose, int]:
        """Return the pose of ``source`` in ``target`` at a time, and that time, in ns.

        Time 0 means the newest time that all moving edges between the frames have reached. If no
        edge moves, it stays 0. The quaternion's w is not negative. The pose of a frame in itself
        is the identity, even if the frame is unknown.

        Raises:
            InvalidArgumentException: if a name is empty or starts with a slash.
            LookupException: if a frame is unknown.
            ConnectivityException: if the frames are in two trees.
            ExtrapolationException: if an edge between them has no samples around that time.
        """
        (x, y, z, *quat), stamp_ns = self._pose(target, source, stamp_ns)
        return Pose((x, y, z), (quat[0], quat[1], quat[2], quat[3])), stamp_ns

    def latest(self, target: str, source: str) -> tuple[Pose, int | None]:
        """Return the same as ``lookup`` for time 0.

        The time is None if all edges between the frames are fixed.
        """
        pose, stamp_ns = self.lookup(target, source)
        return pose, stamp_ns or None

    def behind(self, target: str, source: str) -> str | None:
        """Return the moving edge whose newest sample is oldest, as "parent → child", or None.

        Raises:
            LookupException: if a frame is unknown.
            ConnectivityException: if the frames are in two trees.
        """
        with self._lock:
            moving = self._chain_between(target, source).moving if target != source else []
            if not moving:
                return None
            last = min(moving, key=lambda cache: cache.newest_ns)
            return f"{last.parent} → {last.child}"

    def all_frames(self) -> list[FrameInfo]:
        """Return the edge of each frame, in the order of their first appearance."""
        with self._lock:
            return [_frame_info(name, self._caches.get(name)) for name in self._names]

    def clear(self) -> None:
        """Drop all samples of moving edges. Fixed edges and names stay, as in tf2."""
        with self._lock:
            for cache in self._caches.values():
                if not cache.static:
                    cache.clear()
            self._chains.clear()
            self._mixed.clear()

    def can_lookup(self, target: str, source: str, stamp_ns: int = 0) -> str:
        """Return the reason why ``lookup`` would fail; empty if it would succeed."""
        try:
            self._pose(target, source, stamp_ns)
        except TransformException as error:
            return str(error)
        return ""

    def lock(self) -> RLock:
        """Return a context in which no other thread can add transforms."""
        return self._lock

    def chain_for_all_times(self, target: str, source: str) -> PoseChain | None:
        """Return the chain between two frames, None if a frame has changed its parent.

        Raises:
            LookupException, ConnectivityException, InvalidArgumentException: as ``lookup`` for
                time 0.
        """
        if self._mixed:
            return None
        return self._chain_between(target, source) if target != source else PoseChain((), ())

    def _pose(self, target: str, source: str, stamp_ns: int) -> tuple[PoseTuple, int]:
        """Return the same as ``lookup``, as numbers."""
        with self._lock:
            if target == source:
                return IDENTITY, stamp_ns or self._newest_ns(target)
            chain = self._chains.get((target, source)) or self._chain_between(
                target, source, stamp_ns
            )
            at_ns = stamp_ns or chain.common_ns()
            if self._mixed and at_ns:
                return self._pose_at(target, source, at_ns), at_ns
            if chain.fixed is not None:
                return chain.fixed, stamp_ns
            pose = chain.pose_at(at_ns)
            if pose is None:
                try:
                    pose = self._pose_at(target, source, at_ns)
                except ExtrapolationException as error:
                    if stamp_ns:
                        raise
                    raise no_common_time(chain.moving) from error
            return pose, at_ns

    def _full_pose(
        self, target: str, target_ns: int, source: str, source_ns: int, fixed: str
    ) -> tuple[PoseTuple, int]:
        """Return the pose of the source at a time in the target at another time, and that time."""
        with self._lock:
            self._require(target, "target_frame")
            self._require(source, "source_frame")
            self._require(fixed, "fixed_frame")
            first, _ = self._pose(fixed, source, source_ns)
            second, stamp_ns = self._pose(target, fixed, target_ns)
        return unit(product(second, first)), stamp_ns

    def _pose_at(self, target: str, source: str, stamp_ns: int) -> PoseTuple:
        """Return the pose by the parents at that time.

        In a loop of frames, the pose may only be found in the opposite direction.
        """
        pose = chain_at(self._caches, target, source, stamp_ns).pose_at(stamp_ns)
        if pose is None:
            raise ExtrapolationException(
                f"{source} has no pose in {target} at {exceptions.seconds(stamp_ns)}"
            )
        return pose

    def _chain_between(self, target: str, source: str, stamp_ns: int = 0) -> PoseChain:
        """Return the chain between the frames. The chain by newest parents is cached."""
        self._require(target, "target_frame")
        self._require(source, "source_frame")
        try:
            chain = newest_chain(self._caches, target, source)
        except (ConnectivityException, LookupException):
            if not stamp_ns:
                raise
            return chain_at(self._caches, target, source, stamp_ns)
        if len(self._chains) >= _MOST_CHAINS:
            self._chains.clear()
        self._chains[target, source] = chain
        return chain

    def _require(self, frame: str, argument: str) -> None:
        if not frame or frame[0] == "/":
            raise exceptions.unusable_name(frame, argument)
        if frame not in self._names:
            raise exceptions.unknown_frame(frame, argument, self._names)

    def _new_cache(self, child: str, *, static: bool) -> TimeCache:
        """Return the cache for a frame that is new, or becomes fixed or moving."""
        cache = self._caches[child] = TimeCache(child, static=static)
        return cache

    def _forget_chains(self, cache: TimeCache) -> None:
        """Drop cached chains, because an edge is new or has another fixed pose or parent."""
        self.revision += 1
        self._chains.clear()
        (self._mixed.add if cache.mixed else self._mixed.discard)(cache.child)

    def _newest_ns(self, frame: str) -> int:
        cache = self._caches.get(frame)
        return cache.newest_ns if cache and not cache.static and len(cache) else 0


def _frame_info(name: str, cache: TimeCache | None) -> FrameInfo:
    if cache is None or not len(cache):
        return FrameInfo(name, "", static=False, authority="", oldest_ns=0, newest_ns=0, samples=0)
    oldest, newest = (0, 0) if cache.static else (cache.oldest_ns, cache.newest_ns)
    return FrameInfo(
        name,
        cache.parent,
        cache.static,
        authority=cache.authority,
        oldest_ns=oldest,
        newest_ns=newest,
        samples=len(cache),
    )
