"""Comparison of a tree with a golden recording: the same edges, fixed poses, and paths."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING

from tfcompose.foundation.findings import Note, finding
from tfcompose.foundation.geometry import Offset, Pose, angle_between, norm, normalise, offset_of
from tfcompose.foundation.numbers import numbers
from tfcompose.tf.bags import Recording
from tfcompose.tf.tf2.poses import between
from tfcompose.tools.treetest.replay import accepted_pose, names_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from tfcompose.foundation.findings import Finding
    from tfcompose.tools.treetest.case import Case
    from tfcompose.tools.treetest.replay import Arrival

    Topics = tuple[str, str]
    #: Parent and child.
    Pair = tuple[str, str]


@dataclass(slots=True)
class EdgePath:
    """Poses of an edge, in order."""

    #: True: the edge is fixed, and only its newest pose counts.
    static: bool
    poses: list[Pose] = field(default_factory=list)

    def nearest(self, pose: Pose, within: Offset, begin: int) -> tuple[Offset, int]:
        """Return how far the path is from a pose, and the index of its nearest segment.

        The first segment within the limit is taken; the search begins at segment ``begin``.
        """
        best, nearest = None, begin
        for index in _outward(begin, max(1, len(self.poses) - 1)):
            offset = _offset_of_segment(pose, self.poses[index : index + 2], within)
            if not offset.beyond(within):
                return offset, index
            if best is None or _severity(offset, within) < _severity(best, within):
                best, nearest = offset, index
        return best or Offset(0.0, 0.0), nearest


def _outward(begin: int, count: int) -> Iterator[int]:
    """Yield all numbers below ``count``, those near ``begin`` first."""
    yield begin
    for step in range(1, count):
        if begin + step < count:
            yield begin + step
        if begin - step >= 0:
            yield begin - step


def _offset_of_segment(pose: Pose, ends: list[Pose], within: Offset) -> Offset:
    """Return how far a pose is from the nearest one on the way between one or two poses.

    The nearest by position and that by rotation are tried, and the two ends.
    """
    first, last = ends[0], ends[-1]
    parts = [0.0, 1.0]
    way = tuple(b - a for a, b in zip(first.xyz, last.xyz, strict=True))
    if length := norm(way):  # whose square may be too large for a number
        ahead = ((p - a) / length for a, p in zip(first.xyz, pose.xyz, strict=True))
        parts.append(sum(a * (b / length) for a, b in zip(ahead, way, strict=True)))
    if angle := angle_between(first.quat_xyzw, last.quat_xyzw):
        parts.append(angle_between(first.quat_xyzw, pose.quat_xyzw) / angle)
    offsets = (_offset_at(_clamp(part), pose, (first, last)) for part in parts)
    return min(offsets, key=lambda offset: _severity(offset, within))


def _offset_at(part: float, pose: Pose, ends: tuple[Pose, Pose]) -> Offset:
    """Return how far a pose is from the one at a part, 0 to 1, of the way between two."""
    first, last = ends
    values = between((*first.xyz, *first.quat_xyzw, *last.xyz, *last.quat_xyzw), part)
    x, y, z, *quat = values
    return offset_of(Pose((x, y, z), normalise((quat[0], quat[1], quat[2], quat[3]))), pose)


def _clamp(part: float) -> float:
    return min(1.0, max(0.0, part))


def _severity(offset: Offset, within: Offset) -> float:
    return max(offset.xyz_m / max(within.xyz_m, 1e-9), offset.rot_rad / max(within.rot_rad, 1e-9))


@lru_cache(maxsize=4)
def read_golden(bag: str, pairs: tuple[Topics, ...]) -> Mapping[Topics, Mapping[Pair, EdgePath]]:
    """Return the edges of a recording by topics.

    Raises:
        BagError: if it cannot be read.
    """
    trees: dict[Topics, dict[Pair, EdgePath]] = {pair: {} for pair in pairs}
    for message in Recording(bag).messages(*pairs):
        for row in message.rows or ():
            pair, pose = names_of(row), accepted_pose(row)
            if pose is None:
                continue
            tree = trees[message.topics]
            path = tree.setdefault(pair, EdgePath(static=message.static))
            if path.static or message.static:
                path.poses.clear()
            path.static = message.static
            path.poses.append(pose)
    return trees


@dataclass(slots=True)
class ObservedEdge:
    """An edge that came."""

    #: When it came first.
    first_s: float
    #: Whether its newest transform was fixed.
    static: bool


@dataclass(frozen=True, slots=True)
class Deviation:
    """A pose that is not in the golden recording."""

    pose: Pose
    offset: Offset
    #: When it came.
    elapsed_s: float


@dataclass(slots=True)
class GoldenProbe:
    """Compares the edges of a tree with those of a golden recording."""

    golden: Mapping[Pair, EdgePath]
    within: Offset
    observed: dict[Pair, ObservedEdge] = field(default_factory=dict)
    #: The newest pose of fixed edges, and the first of moving edges, that is not in the recording.
    off: dict[Pair, Deviation] = field(default_factory=dict)
    _segments: dict[Pair, int] = field(default_factory=dict)

    def take(self, arrival: Arrival) -> None:
        """Compare the transforms of a message."""
        for row in arrival.rows:
            pair, pose = names_of(row), accepted_pose(row)
            if pose is None:
                continue
            edge = self.observed.setdefault(
                pair, ObservedEdge(arrival.elapsed_s, static=arrival.static)
            )
            edge.static = arrival.static
            path = self.golden.get(pair)
            if path is None or path.static != arrival.static:
                continue
            if arrival.static:
                self.off.pop(pair, None)  # the newest counts
            elif pair in self.off:
                continue
            offset, segment = path.nearest(pose, self.within, self._segments.get(pair, 0))
            self._segments[pair] = segment
            if offset.beyond(self.within):
                self.off[pair] = Deviation(pose, offset, arrival.elapsed_s)


def judge_likeness(case: Case, probe: GoldenProbe) -> Iterator[Finding]:
    """Yield a finding for each edge that is not as in the golden recording."""
    span, name = case.value_span("expect", "like"), case.spec.expect.like
    for pair, path in probe.golden.items():
        edge = " → ".join(pair)
        if pair not in probe.observed:
            message = f"{edge}: expected as in {name}; no transform that tf2 accepts came"
            yield finding("TF931", message, span)
            continue
        if probe.observed[pair].static != path.static:
            kinds = ("moving", "fixed")
            message = (
                f"{edge}: expected a {kinds[path.static]} edge as in {name}; it is"
                f" {kinds[not path.static]}"
            )
            yield finding("TF931", message, span)
        elif pair in probe.off:
            off = probe.off[pair]
            what = "pose" if path.static else "path"
            message = (
                f"{edge}: expected its {what} in {name} within {probe.within.text}; off by"
                f" {off.offset.text} at {off.elapsed_s:.3f} s"
            )
            xyz, quat = numbers(off.pose.xyz), numbers(off.pose.quat_xyzw)
            yield finding(
                "TF931", message, span, notes=[Note(f"it was xyz {xyz}, quat_xyzw {quat}")]
            )
    for pair, observed in probe.observed.items():
        if pair not in probe.golden:
            message = f"{' → '.join(pair)}: not in {name}; it came at {observed.first_s:.3f} s"
            yield finding("TF931", message, span)
