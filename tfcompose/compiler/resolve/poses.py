"""Poses from the robot file, solved for the pose of each child in its parent.

With ``relative_to``, a pose is in another frame than the parent. With ``place``, a pose is the
pose of another frame of the sensor than the mount. Both are solved through fixed edges only,
because a moving edge has no pose before the robot runs.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING

from tfcompose.compiler.resolve.zeros import correct_mimics, with_zero_offset
from tfcompose.foundation.findings import Finding, Note, did_you_mean, finding
from tfcompose.foundation.geometry import IDENTITY_XYZW, OPTICAL_XYZW, Pose, multiply
from tfcompose.foundation.text import list_names
from tfcompose.model.robot import STATIC, advise_left_out, is_optical, may_be_refused
from tfcompose.spec.language.pose import ROTATIONS

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from tfcompose.compiler.resolve.draft import Draft
    from tfcompose.foundation.findings import Span
    from tfcompose.model.robot import Calibration, Edge
    from tfcompose.spec.language.pose import EdgeKeys, Posed, Rotated
    from tfcompose.spec.load import Path


def pose_of(posed: Posed, child: str = "") -> Pose:
    """Return the pose in the file, with the identity where it has no rotation."""
    turned = rotation_of(posed, child)
    x, y, z = posed.xyz
    return Pose((float(x), float(y), float(z)), turned if turned is not None else IDENTITY_XYZW)


def rotation_of(turned: Rotated, child: str = "") -> tuple[float, float, float, float] | None:
    """Return the rotation in the file as a quaternion x, y, z, w, None without a rotation.

    For an optical frame, ``look`` is the direction of z.
    """
    rotation = turned.rotation
    if rotation is not None and turned.look is not None and is_optical(child):
        return multiply(rotation, OPTICAL_XYZW)
    return rotation


def place_of(keys: EdgeKeys | None) -> str | None:
    """Return the frame whose pose the file states for a mount, None for the mount itself."""
    return getattr(keys, "place", None)


def group_of(edge: Edge) -> Path:
    """Return the path of the part or sensor that the edge mounts or belongs to.

    Empty for any other edge.
    """
    return edge.entry[:2] if edge.entry[:1] in {("parts",), ("sensors",)} else ()


def solve_poses(draft: Draft) -> Iterator[Finding]:
    """Set the pose of each edge to the pose of its child in its parent.

    A pose includes the offset of the joint's zero.

    An edge that cannot be solved keeps the pose from the file.
    """
    tolerates = partial(
        may_be_refused,
        broken=frozenset(draft.broken),
        declared=(*draft.frames, *draft.process_names),
    )
    solver = _Solver(draft, draft.edges, tolerates)
    draft.edges = solver.solve()
    correct_mimics(draft)
    yield from solver.findings


#: Maximum depth of recursion along a chain of relative poses. A longer chain is solved from its
#: far end.
_DEEPEST = 50


class _DeeperError(Exception):
    """Another edge must be solved first, because following the chain would recurse too deep.

    ``index`` is the index of that edge.
    """

    def __init__(self, index: int) -> None:
        self.index = index
        super().__init__(index)


class _UnsolvableError(Exception):
    """A pose cannot be solved. ``finding`` is None if the cause is a rejected entry."""

    def __init__(self, finding: Finding | None) -> None:
        self.finding = finding
        super().__init__(finding)


@dataclass(slots=True)
class _Solver:
    """Solves the edges of a draft, by index."""

    draft: Draft
    edges: list[Edge]
    #: Returns whether a frame, or the edge to it, may be missing because of a rejected entry.
    tolerates: Callable[[str], bool]
    #: Findings about edges that cannot be solved.
    findings: list[Finding] = field(default_factory=list)
    _solved: dict[int, Edge] = field(default_factory=dict)
    _open: list[int] = field(default_factory=list)
    _above: dict[str, int] = field(default_factory=dict)

    def solve(self) -> list[Edge]:
        """Return the edges with their solved poses, in order."""
        for index, edge in enumerate(self.edges):
            self._above.setdefault(edge.child, index)
        for index in range(len(self.edges)):
            waiting = [index]
            while waiting:
                try:
                    self._edge(waiting[-1])
                    waiting.pop()
                except _DeeperError as deeper:
                    if deeper.index in waiting:
                        self._give_up(waiting.pop(), self._circle([deeper.index]))
                    else:
                        waiting.append(deeper.index)
                except _UnsolvableError as error:
                    self._give_up(waiting.pop(), error.finding)
                self._open.clear()
        return [self._solved[index] for index in range(len(self.edges))]

    def _give_up(self, index: int, finding: Finding | None) -> None:
        if finding and finding not in self.findings:
            self.findings.append(finding)
        edge = replace(self.edges[index], calibration=None)
        self._solved[index] = with_zero_offset(edge, self.draft.keys.get(index))

    def _edge(self, index: int) -> Edge:
        if index in self._solved:
            return self._solved[index]
        if index in self._open:
            raise _UnsolvableError(self._circle(self._open[self._open.index(index) :]))
        if len(self._open) >= _DEEPEST:
            raise _DeeperError(index)
        self._open.append(index)
        edge, keys = self.edges[index], self.draft.keys.get(index)
        if edge.calibration and keys:
            edge = self._calibrate(index, edge.calibration, keys)
        elif keys and (keys.relative_to or place_of(keys)):
            edge = replace(edge, pose=self._declared_pose(index, keys))
        edge = with_zero_offset(edge, keys)
        self._open.pop()
        self._solved[index] = edge
        return edge

    def _span_of(self, index: int, key: str) -> Span:
        """Return the span of the value of an edge's key."""
        return self.draft.spec.span_of((*self.edges[index].entry, key))

    def _is_broken(self, index: int) -> bool:
        """Return whether a value in the edge's entry was rejected."""
        return index in self.draft.keys and self.edges[index].entry in self.draft.validated.broken

    def _declared_pose(self, index: int, keys: EdgeKeys) -> Pose:
        """Return the pose of the edge's child in its parent, computed from the file's pose."""
        edge, place = self.edges[index], place_of(keys)
        pose = edge.pose
        if keys.relative_to:
            span = self._span_of(index, "relative_to")
            pose = (
                self._between(edge.parent, self._known_frame(keys.relative_to, span), span) @ pose
            )
        if place:
            span = self._span_of(index, "place")
            inside = self._inside(edge) if edge.sensor and not self._is_broken(index) else None
            pose = (
                pose @ self._below(index, self._known_frame(place, span, inside), span).inverse()
            )
        return pose

    def _calibrate(self, index: int, measured: Calibration, keys: EdgeKeys) -> Edge:
        """Return the edge with its calibrated pose and its nominal pose."""
        edge, span = self.edges[index], measured.named_at
        above = below = Pose()
        if measured.parent != edge.parent:
            above = self._between(edge.parent, measured.parent, span)
        if measured.child != edge.child:
            is_place = measured.child == place_of(keys)
            below_at = self._span_of(index, "place") if is_place else span
            below = self._below(index, measured.child, below_at)
        if (ROTATIONS | {"xyz"}) & keys.model_fields_set:
            nominal = above.inverse() @ self._declared_pose(index, keys) @ below
            measured = replace(measured, nominal=nominal)
        return replace(edge, pose=above @ measured.pose @ below.inverse(), calibration=measured)

    def _inside(self, edge: Edge) -> list[str]:
        """Return the frames that the edge's entry defines, with the entry's own frame first."""
        group = group_of(edge)
        return [member.child for member in self.edges if group_of(member) == group]

    def _known_frame(self, frame: str, span: Span, inside: list[str] | None = None) -> str:
        """Return the frame if it exists, otherwise raise.

        ``inside`` lists the frames that are valid here; None for all frames.
        """
        if frame in self.draft.frames:
            return frame
        if self.tolerates(frame) and not inside:
            raise _UnsolvableError(None)
        otherwise = f"one of: {list_names(inside)}" if inside else ""
        advice = advise_left_out(self.draft.validated.conditions, frame) or did_you_mean(
            frame, inside or self.draft.frames, otherwise
        )
        raise _UnsolvableError(finding("TF203", f"unknown frame {frame}", span, help=advice))

    def _chain(self, frame: str) -> list[tuple[str, int]]:
        """Return the frame and its ancestors, each with the index of its edge; -1 for the root."""
        chain: dict[str, int] = {}
        while frame in self._above and frame not in chain:
            chain[frame] = self._above[frame]
            frame = self.edges[self._above[frame]].parent
        return [*chain.items(), (frame, -1)]

    def _between(self, a: str, b: str, span: Span) -> Pose:
        """Return the pose of frame ``b`` in frame ``a`` through fixed edges."""
        up_a, up_b = self._chain(a), self._chain(b)
        ancestors = {frame for frame, _ in up_a}
        meeting = next((frame for frame, _ in up_b if frame in ancestors), None)
        if meeting is None and (self.tolerates(up_a[-1][0]) or self.tolerates(up_b[-1][0])):
            raise _UnsolvableError(None)
        if meeting is None:
            message = (
                f"{b} and {a} are in two trees, so the pose of the one in the other is not known"
            )
            raise _UnsolvableError(finding("TF404", message, span))
        return self._down(up_a, meeting, span).inverse() @ self._down(up_b, meeting, span)

    def _down(self, chain: list[tuple[str, int]], top: str, span: Span) -> Pose:
        """Return the pose of the chain's first frame in ``top``, one of its ancestors."""
        pose = Pose()
        for frame, index in chain:
            if frame == top:
                break
            edge = self.edges[index]
            if edge.kind != "static" and self._is_broken(index):
                raise _UnsolvableError(None)
            if edge.kind != "static" and not (
                edge.sensor and not edge.declared
            ):  # a driver may publish it repeatedly
                note = Note(f"{edge.name} is published by {edge.owner}", edge.span)
                what = (
                    f"the joint {edge.joint.name} moves"
                    if edge.joint
                    else f"the edge {edge.name} moves"
                )
                advice = "name a frame with only fixed edges on the way to it"
                message = f"{what}, so the pose cannot be solved"
                raise _UnsolvableError(finding("TF404", message, span, notes=[note], help=advice))
            if not edge.pose_known and edge.owner == STATIC:
                raise _UnsolvableError(None)  # TF605 reports it
            if not edge.pose_known:
                message = (
                    f"only {edge.owner} knows where {edge.child} is, so the pose cannot be solved"
                )
                advice = _values_of(edge)
                raise _UnsolvableError(finding("TF404", message, span, help=advice))
            pose = self._edge(index).pose @ pose
        return pose

    def _below(self, index: int, place: str, span: Span) -> Pose:
        """Return the pose of ``place`` in the edge's child, which must be above ``place``."""
        chain = self._chain(place)
        names = [frame for frame, _ in chain]
        outer, is_broken = self.edges[index], self._is_broken(index)
        mount = outer.child
        if mount not in names and (is_broken or self.tolerates(names[-1])):
            raise _UnsolvableError(None)
        if mount not in names:
            message = (
                f"{place} is not a frame of this sensor"
                if outer.sensor
                else f"{place} is not below {mount}"
            )
            inside = self._inside(outer)
            advice = did_you_mean(place, inside, f"one of: {list_names(inside)}")
            raise _UnsolvableError(finding("TF404", message, span, help=advice))
        pose = self._down(chain, mount, span)
        inner = [self.edges[step] for _, step in chain[: names.index(mount)]]
        nominal = [edge for edge in inner if edge.nominal and edge.owner != STATIC]
        if nominal and not is_broken:
            edge = nominal[-1]
            message = (
                f"{place} is placed through {edge.name}, which {edge.owner} publishes with its"
                " unit's own values"
            )
            advice = _values_of(edge)
            self.findings.append(finding("TF405", message, span, help=advice))
        return pose

    def _circle(self, indexes: list[int]) -> Finding:
        edges = [self.edges[index] for index in indexes]
        span = edges[0].span
        for index in reversed(indexes):
            keys = self.draft.keys.get(index)
            if keys and keys.relative_to:
                span = self._span_of(index, "relative_to")
            elif place_of(keys):
                span = self._span_of(index, "place")
        names = ", ".join(edge.name for edge in edges)
        return finding("TF404", f"these poses are given relative to each other: {names}", span)


def _values_of(edge: Edge) -> str:
    """Return help for a frame whose values differ from unit to unit and are not in the file."""
    return (
        f"write this unit's values at the sensor: frames: {{{edge.child}: {{xyz: […], rpy: […]}}}}"
    )
