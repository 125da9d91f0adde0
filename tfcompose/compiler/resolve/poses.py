"""Poses as they were written become poses of the child in its parent.

``relative_to`` gives a pose in another frame than the parent, ``place`` gives that of another
frame of the sensor than its mount. Both are solved through fixed edges only: what moves has no
pose before the robot runs.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from tfcompose.foundation.findings import Finding, Note, did_you_mean, finding
from tfcompose.foundation.geometry import IDENTITY_XYZW, OPTICAL_XYZW, Pose, multiply
from tfcompose.foundation.text import listed
from tfcompose.model.robot import STATIC, is_optical, left_out_by

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Mapping

    from tfcompose.foundation.findings import Span
    from tfcompose.model.robot import Calibration, Edge
    from tfcompose.spec.language.pose import Posed, Rotated
    from tfcompose.spec.load import Path


def pose_of(posed: Posed, child: str = "") -> Pose:
    """Return the pose as it is written."""
    turned = rotation_of(posed, child)
    x, y, z = posed.xyz
    return Pose((float(x), float(y), float(z)), turned if turned is not None else IDENTITY_XYZW)


def rotation_of(turned: Rotated, child: str = "") -> tuple[float, float, float, float] | None:
    """Return the rotation that is written, or None if there is none.

    ``look`` of an optical frame is where z points.
    """
    rotation = turned.rotation
    if rotation is not None and turned.look is not None and is_optical(child):
        return multiply(rotation, OPTICAL_XYZW)
    return rotation


@dataclass(frozen=True, slots=True)
class Draft:
    """An edge whose pose may still have to be solved.

    Its ``pose`` is that of ``place``, in ``relative_to``.

    ``at`` is where it is written. With ``measured`` the pose is that of a calibration, and the one
    that is written is the nominal one, if ``has_nominal``. An edge into or inside a ``part``
    belongs to that.
    """

    edge: Edge
    relative_to: str | None = None
    relative_at: Span | None = None
    place: str | None = None
    place_at: Span | None = None
    at: Path = ()
    part: str | None = None
    measured: Calibration | None = None
    has_nominal: bool = False

    @property
    def group(self) -> tuple[str, str] | None:
        """The part or the sensor whose mount the edge is, or in which it is.

        None for any other edge.
        """
        if self.part is not None:
            return ("parts", self.part)
        return ("sensors", self.edge.sensor) if self.edge.sensor else None


#: How deep a chain of poses that are given relative to each other is followed before it is solved
#: from its far end.
_DEEPEST = 50


class _DeeperError(Exception):
    """The edge of this index must be solved first.

    Following the chain further would end the interpreter.
    """

    def __init__(self, index: int) -> None:
        self.index = index
        super().__init__(index)


class _UnsolvableError(Exception):
    """A pose cannot be solved; ``found`` is None if that follows from a refused entry."""

    def __init__(self, found: Finding | None) -> None:
        self.found = found
        super().__init__(found)


@dataclass(slots=True)
class Solver:
    """Solves the drafts of one robot; ``found`` holds what could not be solved.

    ``broken`` are the paths of entries that were refused in part, ``excuses`` tells of a frame
    whether it, or the edge above it, may be missing because an entry was refused, and
    ``conditions`` are those of entries that are left out.
    """

    drafts: list[Draft]
    frames: dict[str, Span]
    broken: Collection[Path] = ()
    excuses: Callable[[str], bool] = lambda _frame: False
    conditions: Mapping[tuple[str, str], str] = field(default_factory=dict)
    found: list[Finding] = field(default_factory=list)
    _solved: dict[int, Edge] = field(default_factory=dict)
    _open: list[int] = field(default_factory=list)
    _above: dict[str, int] = field(default_factory=dict)

    def solve(self) -> tuple[Edge, ...]:
        """Return the edges in the order of the drafts.

        One that cannot be solved keeps the pose as written.
        """
        for index, draft in enumerate(self.drafts):
            self._above.setdefault(draft.edge.child, index)
        for index in range(len(self.drafts)):
            waiting = [index]
            while waiting:
                try:
                    self._edge(waiting[-1])
                    waiting.pop()
                except _DeeperError as deeper:
                    if deeper.index in waiting:
                        self._give_up(waiting.pop(), _circle([self.drafts[deeper.index]]))
                    else:
                        waiting.append(deeper.index)
                except _UnsolvableError as error:
                    self._give_up(waiting.pop(), error.found)
                self._open.clear()
        return tuple(self._solved[index] for index in range(len(self.drafts)))

    def _give_up(self, index: int, found: Finding | None) -> None:
        if found and found not in self.found:
            self.found.append(found)
        self._solved[index] = self.drafts[index].edge

    def _edge(self, index: int) -> Edge:
        if index in self._solved:
            return self._solved[index]
        draft = self.drafts[index]
        if index in self._open:
            raise _UnsolvableError(
                _circle([self.drafts[i] for i in self._open[self._open.index(index) :]])
            )
        if len(self._open) >= _DEEPEST:
            raise _DeeperError(index)
        self._open.append(index)
        solved = draft.edge
        if draft.measured:
            solved = self._measured(draft, draft.measured)
        elif draft.relative_to or draft.place:
            solved = replace(draft.edge, pose=self._declared_pose(draft))
        self._open.pop()
        self._solved[index] = solved
        return solved

    def _declared_pose(self, draft: Draft) -> Pose:
        """Return the pose of the edge's child in its parent, from the pose that is written."""
        pose = draft.edge.pose
        if draft.relative_to:
            at = draft.relative_at or draft.edge.at
            pose = self._between(draft.edge.parent, self._known(draft.relative_to, at), at) @ pose
        if draft.place:
            at = draft.place_at or draft.edge.at
            inside = (
                self._inside(draft) if draft.edge.sensor and draft.at not in self.broken else None
            )
            pose = pose @ self._below(draft, self._known(draft.place, at, inside), at).inverse()
        return pose

    def _measured(self, draft: Draft, measured: Calibration) -> Edge:
        """Return the edge with its calibrated pose and its nominal one."""
        edge, at = draft.edge, measured.named_at
        above = below = Pose()
        if measured.parent != edge.parent:
            above = self._between(edge.parent, measured.parent, at)
        if measured.child != edge.child:
            place_at = draft.place_at if measured.child == draft.place else None
            below = self._below(draft, measured.child, place_at or at)
        if draft.has_nominal:
            measured = replace(
                measured, nominal=above.inverse() @ self._declared_pose(draft) @ below
            )
        return replace(edge, pose=above @ measured.pose @ below.inverse(), calibration=measured)

    def _inside(self, draft: Draft) -> list[str]:
        """Return the frames that the entry of the draft brings, its own first."""
        return [one.edge.child for one in self.drafts if one.group == draft.group]

    def _known(self, frame: str, at: Span, inside: list[str] | None = None) -> str:
        """Return the frame, which must be one of ``inside``, those that nobody else brings."""
        if frame in self.frames:
            return frame
        if self.excuses(frame) and not inside:
            raise _UnsolvableError(None)
        otherwise = f"one of: {listed(inside)}" if inside else ""
        advice = left_out_by(self.conditions, frame) or did_you_mean(
            frame, inside or self.frames, otherwise
        )
        raise _UnsolvableError(finding("TF203", f"unknown frame {frame}", at, help=advice))

    def _chain(self, frame: str) -> list[tuple[str, int]]:
        """Return the frame and its ancestors, each with the index of its edge (the root: −1)."""
        chain: dict[str, int] = {}
        while frame in self._above and frame not in chain:
            chain[frame] = self._above[frame]
            frame = self.drafts[self._above[frame]].edge.parent
        return [*chain.items(), (frame, -1)]

    def _between(self, a: str, b: str, at: Span) -> Pose:
        """Return the pose of b in a, through fixed edges."""
        up_a, up_b = self._chain(a), self._chain(b)
        ancestors = {frame for frame, _ in up_a}
        meeting = next((frame for frame, _ in up_b if frame in ancestors), None)
        if meeting is None and (self.excuses(up_a[-1][0]) or self.excuses(up_b[-1][0])):
            raise _UnsolvableError(None)
        if meeting is None:
            message = (
                f"{b} and {a} are in two trees, so the pose of the one in the other is not known"
            )
            raise _UnsolvableError(finding("TF404", message, at))
        return self._down(up_a, meeting, at).inverse() @ self._down(up_b, meeting, at)

    def _down(self, chain: list[tuple[str, int]], top: str, at: Span) -> Pose:
        """Return the pose of the chain's first frame in ``top``."""
        pose = Pose()
        for frame, index in chain:
            if frame == top:
                break
            edge = self.drafts[index].edge
            if edge.kind != "static" and self.drafts[index].at in self.broken:
                raise _UnsolvableError(None)
            if edge.kind != "static" and not (
                edge.sensor and not edge.given
            ):  # a driver may send it again and again
                note = Note(f"{edge.name} is published by {edge.owner}", edge.at)
                what = (
                    f"the joint {edge.joint.name} moves"
                    if edge.joint
                    else f"the edge {edge.name} moves"
                )
                advice = "name a frame with only fixed edges on the way to it"
                message = f"{what}, so the pose cannot be solved"
                raise _UnsolvableError(finding("TF404", message, at, notes=[note], help=advice))
            if not edge.pose_known and edge.owner == STATIC:
                raise _UnsolvableError(None)  # TF605 says so
            if not edge.pose_known:
                message = (
                    f"only {edge.owner} knows where {edge.child} is, so the pose cannot be solved"
                )
                advice = _values_of(edge)
                raise _UnsolvableError(finding("TF404", message, at, help=advice))
            pose = self._edge(index).pose @ pose
        return pose

    def _below(self, draft: Draft, place: str, at: Span) -> Pose:
        """Return the pose of ``place`` in the draft's child, which must be above it."""
        chain = self._chain(place)
        names = [frame for frame, _ in chain]
        mount = draft.edge.child
        if mount not in names and (draft.at in self.broken or self.excuses(names[-1])):
            raise _UnsolvableError(None)
        if mount not in names:
            message = (
                f"{place} is not a frame of this sensor"
                if draft.edge.sensor
                else f"{place} is not below {mount}"
            )
            inside = self._inside(draft)
            advice = did_you_mean(place, inside, f"one of: {listed(inside)}")
            raise _UnsolvableError(finding("TF404", message, at, help=advice))
        pose = self._down(chain, mount, at)
        inner = [self.drafts[index].edge for _, index in chain[: names.index(mount)]]
        nominal = [edge for edge in inner if edge.nominal and edge.owner != STATIC]
        if nominal and draft.at not in self.broken:
            edge = nominal[-1]
            message = (
                f"{place} is placed through {edge.name}, which {edge.owner} publishes with its"
                " unit's own values"
            )
            advice = _values_of(edge)
            self.found.append(finding("TF405", message, at, help=advice))
        return pose


def _circle(drafts: list[Draft]) -> Finding:
    names = ", ".join(draft.edge.name for draft in drafts)
    at = next(
        (at for draft in drafts if (at := draft.relative_at or draft.place_at)), drafts[0].edge.at
    )
    return finding("TF404", f"these poses are given relative to each other: {names}", at)


def _values_of(edge: Edge) -> str:
    """Return the help where the values of a unit's own frame are missing."""
    return (
        f"write this unit's values at the sensor: frames: {{{edge.child}: {{xyz: […], rpy: […]}}}}"
    )
