"""The samples of one frame's pose in its parent, kept and read as tf2's ``TimeCache`` and ``StaticCache`` do."""

from __future__ import annotations

import struct
from array import array
from bisect import bisect_right
from typing import Literal

from tfcompose.observe.rotation import Seven, between

#: What became of a sample: it was too old; taken; taken, and it changed a fixed pose or a parent.
Outcome = Literal["old", "taken", "changed"]

#: Seven doubles as an array holds them.
pack_pose = struct.Struct("7d").pack

# Samples that are over are removed so many at a time.
_COMPACT = 256


class History:
    """The samples of one child, oldest first; those before ``start`` are over. A static one has one, good at any time.

    ``parent`` is that of the newest sample, and empty where all samples were cleared; ``mixed`` says that samples have
    different parents. Of samples of one time only the first and the last that came are kept: no answer depends on more.
    Times and poses are kept as plain numbers, seven for a pose, which takes a quarter of the memory of objects.
    """

    __slots__ = ("authority", "child", "mixed", "parent", "parents", "poses", "stamps", "start", "static")

    def __init__(self, child: str, *, static: bool) -> None:
        self.child = child
        self.static = static
        self.authority = ""
        self.clear()

    def __len__(self) -> int:
        return len(self.stamps) - self.start

    def clear(self) -> None:
        """Forget all samples."""
        self.parent = ""
        self.mixed = False
        self.start = 0
        self.stamps = array("q")
        self.poses = array("d")
        self.parents: list[str] = []

    @property
    def oldest_ns(self) -> int:
        """The time of the oldest sample, in nanoseconds."""
        return self.stamps[self.start]

    @property
    def newest_ns(self) -> int:
        """The time of the newest sample, in nanoseconds."""
        return self.stamps[-1]

    def append(self, stamp_ns: int, pose: bytes, cache_ns: int) -> bool:
        """Take the next sample of a moving edge that has one parent, and return True; else do nothing.

        ``pose`` is what ``pack_pose`` gives: an array takes it in a third of the time of seven numbers.
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

    def insert(self, stamp_ns: int, parent: str, pose: Seven, cache_ns: int) -> Outcome:
        """Take a sample, as tf2 does: first drop what is older than ``cache_ns`` before the newest so far."""
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

    def pose(self, index: int) -> Seven:
        """Return the pose of one sample; −1 is the newest."""
        x, y, z, qx, qy, qz, qw = self.poses[7 * index : 7 * index + 7 or None]
        return x, y, z, qx, qy, qz, qw

    def at(self, stamp_ns: int) -> Seven | None:
        """Return the pose at that time (0: the newest), between two samples of one parent interpolated.

        Between samples of two parents the older holds. None: there is no sample before, or none after.
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
        """Return the parent of the pose that ``at`` gives, or nothing where that is None."""
        if self.static or not stamp_ns:
            return self.parent
        stamps = self.stamps
        index = bisect_right(stamps, stamp_ns, self.start)
        if index == self.start or (index == len(stamps) and stamps[-1] != stamp_ns):
            return ""
        first = stamps[index - 1] == stamp_ns == stamps[self.start] and index < len(stamps)
        return self.parents[self.start if first else index - 1]

    def _replace(self, stamp_ns: int, parent: str, pose: Seven) -> Outcome:
        poses = array("d", pose)
        same = self.poses == poses and self.parent == parent
        self.stamps, self.poses, self.parents, self.parent = array("q", [stamp_ns]), poses, [parent], parent
        return "taken" if same else "changed"

    def _sort_in(self, stamp_ns: int, parent: str, pose: Seven) -> None:
        end = bisect_right(self.stamps, stamp_ns, self.start)
        begin = end
        while begin > self.start and self.stamps[begin - 1] == stamp_ns:
            begin -= 1
            if self.pose(begin) == pose and self.parents[begin] == parent:
                return
        if end - begin > 1:
            self.poses[7 * end - 7 : 7 * end], self.parents[end - 1] = array("d", pose), parent
            return
        self.stamps.insert(end, stamp_ns)
        self.poses[7 * end : 7 * end] = array("d", pose)
        self.parents.insert(end, parent)

    def _of_several_parents(self) -> Outcome:
        """Look again whether all samples have one parent, and which the newest has."""
        before = self.parent, self.mixed
        self.parent = self.parents[-1]
        self.mixed = any(self.parents[index] != self.parent for index in range(self.start, len(self.parents)))
        return "taken" if before == (self.parent, self.mixed) else "changed"

    def _prune(self, limit_ns: int) -> None:
        start = self.start
        while self.stamps[start] < limit_ns:
            start += 1
        self.start = start
        if start > _COMPACT:
            del self.stamps[:start], self.poses[: 7 * start], self.parents[:start]
            self.start = 0
