"""Cache of each edge's poses, and the chain of edges from a frame to another frame.

``TimeCache`` holds a frame's poses in its parent over time, like tf2's ``TimeCache`` and
``StaticCache``. ``PoseChain`` is the product of the edges between two frames, with neighbouring
fixed edges multiplied in advance. ``newest_chain`` and ``chain_at`` find it, like tf2's
``BufferCore::walkToTopParent``.
"""

from __future__ import annotations

import struct
from array import array
from bisect import bisect_right
from typing import TYPE_CHECKING, Literal

from tfcompose.tf.tf2 import exceptions
from tfcompose.tf.tf2.exceptions import (
    ExtrapolationException,
    milliseconds,
    seconds,
    tf2_time,
)
from tfcompose.tf.tf2.poses import (
    IDENTITY,
    PoseTuple,
    between,
    inverse,
    inverse_product,
    product,
    unit,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Container, Mapping, Sequence

#: Result of inserting a sample: too old; accepted; or accepted with a change of a fixed pose or a
#: parent.
Outcome = Literal["old", "taken", "changed"]

#: Packs seven doubles as in an array.
pack_pose = struct.Struct("7d").pack

# Number of expired samples removed at a time.
_COMPACT = 256


class TimeCache:
    """The samples of a child frame, oldest first.

    A static frame has a single sample, valid at any time.

    ``parent`` is the parent of the newest sample; it is empty if all samples were cleared.
    ``mixed``: samples have different parents. Of samples with the same stamp, only the first and
    the last received are kept, because no answer depends on the others. ``repeated`` holds all of
    them by stamp, so that a duplicate does not replace the last one. Times and poses are plain
    numbers, seven for a pose, which take a quarter of the memory of objects. Samples before the
    index ``start`` have expired.
    """

    __slots__ = (
        "authority",
        "child",
        "mixed",
        "parent",
        "parents",
        "poses",
        "repeated",
        "stamps",
        "start",
        "static",
    )

    def __init__(self, child: str, *, static: bool) -> None:
        self.child = child
        self.static = static
        self.authority = ""
        self.clear()

    def __len__(self) -> int:
        return len(self.stamps) - self.start

    def clear(self) -> None:
        """Drop all samples."""
        self.parent = ""
        self.mixed = False
        self.start = 0
        self.stamps = array("q")
        self.poses = array("d")
        self.parents: list[str] = []
        self.repeated: dict[int, set[tuple[str, PoseTuple]]] = {}

    @property
    def oldest_ns(self) -> int:
        """The time of the oldest sample, in nanoseconds."""
        return self.stamps[self.start]

    @property
    def newest_ns(self) -> int:
        """The time of the newest sample, in nanoseconds."""
        return self.stamps[-1]

    def append(self, stamp_ns: int, pose: bytes, cache_ns: int) -> bool:
        """Add the next sample of a moving edge with a single parent, and return True.

        Otherwise do nothing and return False. ``pose`` comes from ``pack_pose``. An array accepts
        it in a third of the time of seven numbers.
        """
        stamps = self.stamps
        if self.static or self.mixed or not stamps or stamp_ns <= stamps[-1]:
            return False
        if stamps[self.start] < stamps[-1] - cache_ns:
            self._prune(stamps[-1] - cache_ns)
        stamps.append(stamp_ns)
        self.poses.frombytes(pose)
        self.parents.append(self.parent)
        return True

    def insert(self, stamp_ns: int, parent: str, pose: PoseTuple, cache_ns: int) -> Outcome:
        """Insert a sample, as tf2 does.

        First, samples that are more than ``cache_ns`` older than the newest sample are dropped.
        """
        if self.static:
            return self._replace(stamp_ns, parent, pose)
        stamps = self.stamps
        if not stamps:
            stamps.append(stamp_ns)
            self.poses.extend(pose)
            self.parents.append(parent)
            self.parent = parent
            return "changed"
        newest = stamps[-1]
        limit = newest - cache_ns
        pruned = stamps[self.start] < limit
        if pruned:
            self._prune(limit)
        if stamp_ns < limit:
            return "old"
        if stamp_ns > newest:
            stamps.append(stamp_ns)
            self.poses.extend(pose)
            self.parents.append(parent)
        else:
            self._sort_in(stamp_ns, parent, pose)
        if parent != self.parent or self.mixed:
            return self._of_several_parents()
        return "taken"

    def pose(self, index: int) -> PoseTuple:
        """Return the pose of a sample; -1 is the newest."""
        x, y, z, qx, qy, qz, qw = self.poses[7 * index : 7 * index + 7 or None]
        return x, y, z, qx, qy, qz, qw

    def pose_at(self, stamp_ns: int) -> PoseTuple | None:
        """Return the pose at a time (0: newest), interpolated between two samples.

        Between samples with different parents, the older sample is valid. None if there is no
        sample before the time, or none after.
        """
        stamps = self.stamps
        if self.static or not stamp_ns:
            return self.pose(-1) if stamps else None
        index = bisect_right(stamps, stamp_ns, self.start)
        if index == len(stamps):
            return self.pose(-1) if stamps and stamps[-1] == stamp_ns else None
        if index == self.start:
            return None
        before = stamps[index - 1]
        if before == stamp_ns:
            return self.pose(self.start if before == stamps[self.start] else index - 1)
        if self.mixed and self.parents[index - 1] != self.parents[index]:
            return self.pose(index - 1)
        part = (stamp_ns - before) / (stamps[index] - before)
        return between(self.poses[7 * index - 7 : 7 * index + 7], part)

    def parent_at(self, stamp_ns: int) -> str:
        """Return the parent of the pose from ``pose_at``; empty if there is no such pose."""
        if self.static or not stamp_ns:
            return self.parent
        stamps = self.stamps
        index = bisect_right(stamps, stamp_ns, self.start)
        if index == self.start or (index == len(stamps) and stamps[-1] != stamp_ns):
            return ""
        first = stamps[index - 1] == stamp_ns == stamps[self.start] and index < len(stamps)
        return self.parents[self.start if first else index - 1]

    def _replace(self, stamp_ns: int, parent: str, pose: PoseTuple) -> Outcome:
        poses = array("d", pose)
        same = self.poses == poses and self.parent == parent
        self.stamps, self.poses, self.parents, self.parent = (
            array("q", [stamp_ns]),
            poses,
            [parent],
            parent,
        )
        return "taken" if same else "changed"

    def _sort_in(self, stamp_ns: int, parent: str, pose: PoseTuple) -> None:
        end = bisect_right(self.stamps, stamp_ns, self.start)
        if end > self.start and self.stamps[end - 1] == stamp_ns:
            entries = self.repeated.setdefault(
                stamp_ns, {(self.parents[end - 1], self.pose(end - 1))}
            )
            if (parent, pose) in entries:
                return
            entries.add((parent, pose))
            if len(entries) > 2:  # noqa: PLR2004 (the first and the last so far)
                self.poses[7 * end - 7 : 7 * end], self.parents[end - 1] = array("d", pose), parent
                return
        self.stamps.insert(end, stamp_ns)
        self.poses[7 * end : 7 * end] = array("d", pose)
        self.parents.insert(end, parent)

    def _of_several_parents(self) -> Outcome:
        """Check again whether all samples have the same parent, and update the newest parent."""
        before = self.parent, self.mixed
        self.parent = self.parents[-1]
        self.mixed = any(
            self.parents[index] != self.parent for index in range(self.start, len(self.parents))
        )
        return "taken" if before == (self.parent, self.mixed) else "changed"

    def _prune(self, limit_ns: int) -> None:
        start = self.start
        while self.stamps[start] < limit_ns:
            start += 1
        self.start = start
        if self.repeated:
            self.repeated = {
                stamp_ns: entries
                for stamp_ns, entries in self.repeated.items()
                if stamp_ns >= limit_ns
            }
        if start > _COMPACT:
            del self.stamps[:start], self.poses[: 7 * start], self.parents[:start]
            self.start = 0


#: A link: a fixed pose; or the samples of a moving edge, and whether the chain passes it from
#: parent to child.
Link = tuple[None, PoseTuple, bool] | tuple["TimeCache", None, bool]


class PoseChain:
    """The pose of the source in the target as a product of links, starting at the source.

    ``children`` are the child frames of all edges. ``moving`` are the edges with samples over
    time. If there are none, ``fixed`` is the pose, otherwise None.
    """

    __slots__ = ("children", "fixed", "links", "moving")

    def __init__(self, up: Sequence[TimeCache], down: Sequence[TimeCache]) -> None:
        self.children = [cache.child for cache in (*down, *reversed(up))]
        self.moving = [cache for cache in (*down, *up) if not cache.static]
        self.links = _links(
            [*((each, False) for each in down), *((each, True) for each in reversed(up))]
        )
        self.fixed = (
            None if self.moving else unit(self.links[0][1] or IDENTITY) if self.links else IDENTITY
        )

    def pose_at(self, stamp_ns: int) -> PoseTuple | None:
        """Return the source's pose in the target at a time, None if an edge has none."""
        if self.fixed is not None:
            return self.fixed
        pose = None
        for cache, fixed, backwards in self.links:
            link = fixed if cache is None else cache.pose_at(stamp_ns)
            if link is None:
                return None
            if pose is None:
                pose = inverse(link) if backwards else link
            else:
                pose = inverse_product(link, pose) if backwards else product(link, pose)
        return unit(pose or IDENTITY)

    def common_ns(self) -> int:
        """Return the newest time that all moving edges have reached, in nanoseconds.

        0 if no edge moves, as in tf2.
        """
        return min((cache.stamps[-1] for cache in self.moving if cache.stamps[-1]), default=0)


def _links(passed: Sequence[tuple[TimeCache, bool]]) -> list[Link]:
    links: list[Link] = []
    for cache, backwards in passed:
        if not cache.static:
            links.append((cache, None, backwards))
            continue
        pose = inverse(cache.pose(-1)) if backwards else cache.pose(-1)
        before = links[-1][1] if links else None
        if before is not None:
            links[-1] = (None, product(pose, before), False)
        else:
            links.append((None, pose, False))
    return links


def newest_chain(caches: Mapping[str, TimeCache], target: str, source: str) -> PoseChain:
    """Return the chain between two frames by each frame's newest parent.

    Raises:
        LookupException: if the frames above a frame form a loop.
        ConnectivityException: if the frames are in two trees.
    """
    up, down, tops = _meet(caches, target, source, lambda cache: cache.parent)
    if tops:
        raise exceptions.connectivity_error(caches, target, source, tops)
    return PoseChain(up, down)


def chain_at(
    caches: Mapping[str, TimeCache], target: str, source: str, stamp_ns: int
) -> PoseChain:
    """Return the chain between two frames by each frame's parent at a time.

    If an edge without a pose at that time might continue the chain, the error names this edge, as
    in tf2.

    Raises:
        LookupException: if the frames above a frame form a loop.
        ConnectivityException: if the frames are in two trees.
        ExtrapolationException: if an edge between them has no pose at that time.
    """
    up, down, tops = _meet(caches, target, source, lambda cache: cache.parent_at(stamp_ns))
    for top in tops:
        if top in caches:
            raise outside(caches[top], stamp_ns)
    if tops:
        raise exceptions.connectivity_error(caches, target, source, tops)
    return PoseChain(up, down)


def _meet(
    caches: Mapping[str, TimeCache],
    target: str,
    source: str,
    parent_of: Callable[[TimeCache], str],
) -> tuple[list[TimeCache], list[TimeCache], tuple[str, ...]]:
    """Return the edges from target and source to their common ancestor.

    If the paths do not meet, the frames are the two at which they end.
    """
    down, top = _climb(caches, source, {target}, parent_of)
    if top == target:
        return [], down, ()
    passed = [source, *(parent_of(cache) for cache in down)]
    up, meeting = _climb(caches, target, set(passed), parent_of)
    if meeting not in passed:
        return up, down, (meeting, top)
    return up, down[: passed.index(meeting)], ()


def _climb(
    caches: Mapping[str, TimeCache],
    frame: str,
    goal: Container[str],
    parent_of: Callable[[TimeCache], str],
) -> tuple[list[TimeCache], str]:
    """Return the edges from ``frame`` to a frame of the goal or the root, and that frame."""
    way: list[TimeCache] = []
    visited = {frame}
    while frame not in goal:
        cache = caches.get(frame)
        parent = parent_of(cache) if cache else ""
        if not cache or not parent:
            break
        way.append(cache)
        frame = parent
        if frame in visited and frame not in goal:
            raise exceptions.loop(frame, [each.child for each in way])
        visited.add(frame)
    return way, frame


# Exceptions about times.


def outside(cache: TimeCache, stamp_ns: int) -> ExtrapolationException:
    """Return the exception for a time outside the edge's samples, which tells by how much."""
    if not len(cache):
        return ExtrapolationException(
            "Lookup would require extrapolation",
            f"{cache.child} has had no parent since the buffer was cleared",
        )
    edge = f"{cache.parent} → {cache.child} at {seconds(stamp_ns)} would be extrapolation"
    requested = tf2_time(stamp_ns)
    oldest, newest = tf2_time(cache.oldest_ns), tf2_time(cache.newest_ns)
    if len(cache) == 1:
        only = cache.newest_ns
        away = f"{milliseconds(abs(only - stamp_ns))} {'later' if only > stamp_ns else 'earlier'}"
        return ExtrapolationException(
            f"Lookup would require extrapolation at time {requested}, but only time {newest} is in"
            " the buffer",
            f"{edge}: its one sample is {away}, of {seconds(only)}",
        )
    if stamp_ns > cache.newest_ns:
        late = milliseconds(stamp_ns - cache.newest_ns)
        return ExtrapolationException(
            f"Lookup would require extrapolation into the future.  Requested time {requested} but"
            f" the latest data is at time {newest}",
            f"{edge} into the future: its newest sample is {late} earlier, of"
            f" {seconds(cache.newest_ns)}",
        )
    early = milliseconds(cache.oldest_ns - stamp_ns)
    return ExtrapolationException(
        f"Lookup would require extrapolation into the past.  Requested time {requested} but the"
        f" earliest data is at time {oldest}",
        f"{edge} into the past: its oldest sample is {early} later, of {seconds(cache.oldest_ns)}",
    )


def no_common_time(moving: Sequence[TimeCache]) -> ExtrapolationException:
    """Return the exception for edges whose samples have no common time, which names them."""
    behind = min(moving, key=lambda cache: cache.newest_ns)
    ahead = max(moving, key=lambda cache: cache.oldest_ns)
    gap = milliseconds(ahead.oldest_ns - behind.newest_ns)
    return ExtrapolationException(
        "Lookup would require extrapolation into the past.  Requested time"
        f" {tf2_time(behind.newest_ns)} but the earliest data is at time"
        f" {tf2_time(ahead.oldest_ns)}",
        f"{ahead.parent} → {ahead.child} begins {gap} after the last of {behind.parent} →"
        f" {behind.child}: they have no time in common (extrapolation into the past)",
    )
