"""What is known of a TF tree over time, in and out as plain numbers: the part of the buffer that needs no messages."""

from __future__ import annotations

from math import isfinite, sqrt
from threading import Condition, RLock
from typing import TYPE_CHECKING

from tfcompose.geometry import Pose
from tfcompose.observe import reasons
from tfcompose.observe.chain import Chain
from tfcompose.observe.exceptions import (
    ConnectivityException,
    ExtrapolationException,
    InvalidArgumentException,
    LookupException,
    TransformException,
)
from tfcompose.observe.history import History, pack_pose
from tfcompose.observe.refusal import Refusal, refusal
from tfcompose.observe.rotation import IDENTITY, Seven
from tfcompose.observe.walk import newest_ways, ways_at

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

CACHE_NS = 10_000_000_000
# Closer to 1 than this a sum of four squares cannot be told from 1.
_ROUNDING = 1e-15
# So many chains are remembered at most.
_MOST_CHAINS = 4096
_SECOND_NS = 1_000_000_000

#: One transform: parent, child, seconds, nanoseconds, x y z in metres, quaternion x y z w.
Row = tuple[str, str, int, int, float, float, float, float, float, float, float]


class BufferCore:
    """Takes transforms and answers where one frame is in another; safe to use from several threads.

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
        self._news = Condition(self._lock)
        self._waiting = 0
        #: Called after something was taken, by whoever gave it.
        self.on_news: list[Callable[[], object]] = []
        self._histories: dict[str, History] = {}
        self._names: dict[str, None] = {}
        self._chains: dict[tuple[str, str], Chain] = {}
        self._mixed: set[str] = set()

    @property
    def frames(self) -> frozenset[str]:
        """Every frame that was heard of."""
        with self._lock:
            return frozenset(self._names)

    def set(  # noqa: PLR0913 (a transform has that many parts)
        self, parent: str, child: str, pose: Pose, stamp_ns: int, *, static: bool, authority: str = ""
    ) -> bool:
        """Take the pose of ``child`` in ``parent``; return False if tf2 would refuse it."""
        row = (parent, child, 0, stamp_ns, *pose.xyz, *pose.quat_xyzw)
        return not self.insert([row], static=static, authority=authority)

    def insert(self, rows: Iterable[Row], *, static: bool, authority: str = "") -> list[tuple[str, Refusal]]:
        """Take transforms in order; return the child and the reason of each that was refused.

        A leading slash is dropped from names. Not taken is what ``Refusal`` lists, as tf2 says it in its log; infinite
        values count as not a number. Quaternions are normalised.
        """
        refused: list[tuple[str, Refusal]] = []
        with self._lock:
            histories, cache_ns = self._histories, self.cache_ns
            for row in rows:
                # What comes fifty thousand times a second: the next sample of an edge that stays as it is.
                parent, child, sec, nsec, x, y, z, qx, qy, qz, qw = row
                history = histories.get(child)
                if history is not None and history.parent == parent and history.static is static:
                    squared = qx * qx + qy * qy + qz * qz + qw * qw
                    if -_ROUNDING < squared - 1.0 < _ROUNDING and isfinite(x + y + z):
                        pose = pack_pose(x, y, z, qx, qy, qz, qw)
                        if history.append(sec * _SECOND_NS + nsec, pose, cache_ns):
                            history.authority = authority
                            continue
                reason = self._take(row, static=static, authority=authority)
                if reason:
                    refused.append((child.removeprefix("/"), reason))
            if self._waiting:
                self._news.notify_all()
        if self.on_news:
            for tell in tuple(self.on_news):
                tell()
        return refused

    def _take(self, row: Row, *, static: bool, authority: str) -> Refusal | None:
        """Take any transform; return why it was refused."""
        # tf2 strips one slash.
        parent, child = row[0].removeprefix("/"), row[1].removeprefix("/")
        x, y, z, qx, qy, qz, qw = row[4:]
        reason = refusal(parent, child, (x, y, z, qx, qy, qz, qw))
        if reason:
            return reason
        squared = qx * qx + qy * qy + qz * qz + qw * qw
        scale = 1.0 if -_ROUNDING < squared - 1.0 < _ROUNDING else 1 / sqrt(squared)
        history = self._histories.get(child)
        if history is None or history.static is not static:
            history = self._new_history(child, static=static)
        pose = (x, y, z, qx * scale, qy * scale, qz * scale, qw * scale)
        outcome = history.insert(row[2] * _SECOND_NS + row[3], parent, pose, self.cache_ns)
        if outcome != "taken" or history.mixed:
            self._names.setdefault(child)
            self._names.setdefault(parent)
        if outcome == "old":
            return Refusal.OLD
        if outcome == "changed":
            self._changed(history)
        history.authority = authority
        return None

    def lookup(self, target: str, source: str, stamp_ns: int = 0) -> tuple[Pose, int]:
        """Return the pose of ``source`` in ``target`` at a time, and that time, both in nanoseconds since the epoch.

        Time 0 is the newest that all moving edges between them have reached; where none moves it stays 0. The
        quaternion's w is not negative. A frame in itself is the identity, whether it is known or not.

        Raises:
            InvalidArgumentException: if a name is empty or starts with a slash.
            LookupException: if a frame is not known.
            ConnectivityException: if they are in two trees.
            ExtrapolationException: if an edge between them has no samples around that time.
        """
        (x, y, z, *quat), stamp_ns = self._pose(target, source, stamp_ns)
        return Pose((x, y, z), (quat[0], quat[1], quat[2], quat[3])), stamp_ns

    def clear(self) -> None:
        """Forget all samples of moving edges; fixed ones and the names stay, as in tf2."""
        with self._lock:
            for history in self._histories.values():
                if not history.static:
                    history.clear()
            self._chains.clear()
            self._mixed.clear()

    def can_lookup(self, target: str, source: str, stamp_ns: int = 0) -> str:
        """Return nothing if ``lookup`` would answer, else why it would not."""
        try:
            self._pose(target, source, stamp_ns)
        except TransformException as error:
            return str(error)
        return ""

    def at_rest(self) -> RLock:
        """Return a context in which nothing is taken, by any thread."""
        return self._lock

    def chain_for_all_times(self, target: str, source: str) -> Chain | None:
        """Return the chain between two frames, or None where a frame has had several parents within the cache.

        Raises:
            LookupException, ConnectivityException, InvalidArgumentException: as ``lookup`` for time 0.
        """
        if self._mixed:
            return None
        return self._chain(target, source) if target != source else Chain((), ())

    def _pose(self, target: str, source: str, stamp_ns: int) -> tuple[Seven, int]:
        """Return what ``lookup`` does, as numbers."""
        with self._lock:
            if target == source:
                return IDENTITY, stamp_ns or self._newest_ns(target)
            chain = self._chains.get((target, source)) or self._chain(target, source, stamp_ns)
            at_ns = stamp_ns or chain.common_ns()
            if self._mixed and at_ns:
                return self._pose_at(target, source, at_ns), at_ns
            if chain.fixed is not None:
                return chain.fixed, stamp_ns
            pose = chain.at(at_ns)
            if pose is None:
                try:
                    pose = self._pose_at(target, source, at_ns)
                except ExtrapolationException as error:
                    if stamp_ns:
                        raise
                    raise ExtrapolationException(reasons.no_common_time(chain.moving)) from error
            return pose, at_ns

    def _pose_at(self, target: str, source: str, stamp_ns: int) -> Seven:
        """Return the pose by the parents of that time; in a loop of frames the other way round may be the one."""
        pose = Chain(*ways_at(self._histories, target, source, stamp_ns)).at(stamp_ns)
        if pose is None:
            raise ExtrapolationException(f"{source} has no pose in {target} at {reasons.seconds(stamp_ns)}")
        return pose

    def _chain(self, target: str, source: str, stamp_ns: int = 0) -> Chain:
        """Return the chain between the two; the one by newest parents, if there is any, is remembered."""
        self._require(target)
        self._require(source)
        try:
            chain = Chain(*newest_ways(self._histories, target, source))
        except (ConnectivityException, LookupException):
            if not stamp_ns:
                raise
            return Chain(*ways_at(self._histories, target, source, stamp_ns))
        if len(self._chains) >= _MOST_CHAINS:
            self._chains.clear()
        self._chains[target, source] = chain
        return chain

    def _require(self, frame: str) -> None:
        if not frame or frame[0] == "/":
            raise InvalidArgumentException(reasons.unusable_name(frame))
        if frame not in self._names:
            raise LookupException(reasons.UnknownFrame(frame, self._names))

    def _new_history(self, child: str, *, static: bool) -> History:
        """Return the samples of a frame that is new, or fixed from now on, or moving from now on."""
        history = self._histories[child] = History(child, static=static)
        self._mixed.discard(child)
        return history

    def _changed(self, history: History) -> None:
        """Forget the chains, since an edge is new, or has another fixed pose or parent."""
        self._chains.clear()
        (self._mixed.add if history.mixed else self._mixed.discard)(history.child)

    def _newest_ns(self, frame: str) -> int:
        history = self._histories.get(frame)
        return history.newest_ns if history and not history.static and len(history) else 0
