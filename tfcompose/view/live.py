"""What is shown of a running tree: where its frames are, which edges are wrong, and who publishes them.

A ``LiveTree`` is given observers, which somebody feeds, and returns data for a scene and a panel; it reads no clock, no
topic and knows no browser. Frames have the names of the robot file; on the tree they may have a prefix.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from tfcompose.geometry import Pose, offset_of
from tfcompose.live.state import who
from tfcompose.plan.topics import parts_of
from tfcompose.text import duration
from tfcompose.verdict.publishers import flooded
from tfcompose.verdict.tree import rejected_transforms
from tfcompose.verdict.verify import differences, group_finding, grouped, state_of
from tfcompose.view.forest import Forest, pose_of, row_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from tfcompose.findings import Finding, Span
    from tfcompose.geometry import Offset
    from tfcompose.live.edges import EdgeState, EdgeStream, TreeObserver
    from tfcompose.model import Robot
    from tfcompose.plan import Plan
    from tfcompose.verdict.verify import Difference

    Topics = tuple[str, str]

#: Publishers that were there before are found within this time; until then nothing is missing.
FOUND_S = 2.5
_MISSING = frozenset({"TF804", "TF811"})
_TURNING = frozenset({"revolute", "continuous"})


@dataclass(frozen=True, slots=True)
class Picture:
    """Where everything is, in the roots of its trees.

    Attributes:
        robot: the robot with the parents that were published.
        poses: of each of its frames; what did not come is where the robot says.
        further: the poses of frames that are not the robot's.
        ghosts: where the robot has frames that are elsewhere, and all below them.
        wrong: the edges, (parent, child), of which something is wrong.
    """

    robot: Robot
    poses: Mapping[str, Pose]
    further: Mapping[str, Pose] = field(default_factory=dict)
    ghosts: Mapping[str, Pose] = field(default_factory=dict)
    wrong: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True, slots=True)
class Judgement:
    """What is wrong: all findings, those of each frame, and the frames that are not where the robot says."""

    found: tuple[Finding, ...] = ()
    of_frame: Mapping[str, tuple[Finding, ...]] = field(default_factory=dict)
    off: Mapping[str, Offset] = field(default_factory=dict)

    @property
    def wrong(self) -> frozenset[str]:
        """The frames whose edges have an error."""
        return frozenset(
            frame for frame, found in self.of_frame.items() if any(one.severity == "error" for one in found)
        )


class LiveTree:
    """Follows a running robot.

    Args:
        robot: as it is in the file.
        plan: what its processes publish.
        observers: by topics (moving, fixed): those of the plan at least.
        tolerance: how far a pose may be off.
    """

    def __init__(self, robot: Robot, plan: Plan, observers: Mapping[Topics, TreeObserver], tolerance: Offset) -> None:
        self.robot = robot
        self.judgement = Judgement()
        self._plan = plan
        self._observers = observers
        self._tolerance = tolerance
        self._parts = parts_of(plan)
        self._names = {robot.final(frame): frame for frame in robot.frames}
        self._places: dict[str, Span] = {robot.final(edge.child): edge.at for edge in robot.edges}
        self._edges = {edge.child: edge for edge in reversed(robot.edges)}  # of several parents the first
        self._states: dict[str, list[EdgeState]] = {}
        self._parents: dict[str, str] = {}
        self._rows: dict[str, object] = {}
        self._judged: object = None
        self._grow({edge.child: edge.parent for edge in self._edges.values()})

    def _grow(self, parents: dict[str, str]) -> None:
        """Take the parents of frames."""
        self._parents = parents
        frames = dict.fromkeys([*self.robot.frames, *parents, *parents.values()])
        self._forest = Forest(tuple(frames), parents)
        self._local = np.array(
            [row_of(self._edges[one].pose if one in self._edges else Pose()) for one in frames], np.float64
        ).reshape(-1, 7)
        self._rows = {}
        edges = tuple(replace(edge, parent=parents.get(edge.child, edge.parent)) for edge in self.robot.edges)
        self._shown = replace(self.robot, edges=edges)

    # Where frames are.

    def moved(self) -> Picture | None:
        """Return where everything is if something moved, or is judged otherwise, since the last time; else None."""
        newest = self._newest_streams()
        parents = {edge.child: edge.parent for edge in self._edges.values()}
        parents |= {child: self._name(stream.parent) for child, stream in newest.items()}
        if parents != self._parents:
            self._grow(parents)
        changed = {child: stream.row for child, stream in newest.items() if self._rows.get(child) is not stream.row}
        judged = (self.judgement.wrong, frozenset(self.judgement.off))
        if not changed and self._judged == judged:
            return None
        self._judged = judged
        if changed:
            self._rows |= changed
            rows = [self._forest.index[child] for child in changed]
            self._local[rows] = [row[4:11] for row in changed.values()]
        return self._picture()

    def _picture(self) -> Picture:
        placed = dict(zip(self._forest.frames, map(pose_of, self._forest.in_roots(self._local).tolist()), strict=True))
        known = self.robot.frames
        poses = {frame: placed[frame] for frame in known}
        further = {frame: pose for frame, pose in placed.items() if frame not in known}
        wrong = tuple((self._parents[frame], frame) for frame in sorted(self.judgement.wrong) if frame in self._parents)
        return Picture(self._shown, poses, further, self._ghosts(), wrong)

    def _ghosts(self) -> dict[str, Pose]:
        off = self.judgement.off.keys() & self._edges.keys() & self._forest.index.keys()
        if not off:
            return {}
        meant = self._local.copy()
        for child in off:
            row = self._forest.index[child]
            meant[row] = row_of(self._meant(child, pose_of(self._local[row].tolist())))
        placed = self._forest.in_roots(meant)
        frames = self._forest.below(set(off))
        return {one: pose_of(placed[self._forest.index[one]].tolist()) for one in sorted(frames)}

    def _meant(self, child: str, live: Pose) -> Pose:
        """Return where the robot has the frame in its parent; what a joint moves is where it was published."""
        edge = self._edges[child]
        if edge.joint is None:
            return edge.pose
        if edge.joint.type in _TURNING:
            return Pose(edge.pose.xyz, live.quat_xyzw)
        return Pose(live.xyz, edge.pose.quat_xyzw)

    def _newest_streams(self) -> dict[str, EdgeStream]:
        """Return what came last of each frame, as tf2 has it: without what it does not take."""
        newest: dict[str, EdgeStream] = {}
        for observer in self._observers.values():
            for stream in observer.streams:
                if stream.rejected_row is stream.row:
                    continue
                child = self._name(stream.child)
                other = newest.get(child)
                if other is None or stream.arrivals.last_ns >= other.arrivals.last_ns:
                    newest[child] = stream
        return newest

    def _name(self, frame: str) -> str:
        return self._names.get(frame, frame)

    # What is wrong.

    def judge(self, listened_s: float) -> Judgement:
        """Judge what came, after so many seconds of listening, and return what is wrong."""
        found: list[Finding] = []
        of_frame: dict[str, list[Finding]] = {}
        off: dict[str, Offset] = {}
        states: dict[str, list[EdgeState]] = {}
        for topics, part in self._parts.items():
            state = state_of(self._observers[topics], topics)
            for edge in state.edges:
                states.setdefault(self._name(edge.child), []).append(edge)
                for finding in rejected_transforms(edge) if edge.stream.rejected is not None else ():
                    found.append(finding)
                    of_frame.setdefault(self._name(edge.child), []).append(finding)
            kept = [one for one in differences(state, part, self._tolerance) if _counts(one, listened_s)]
            for group in grouped(kept):
                place = self._places.get(group[0].edge.child) if group[0].edge else None
                finding = group_finding(group, state, self._plan, place)
                found.append(finding)
                for child in dict.fromkeys(_children(group)):
                    of_frame.setdefault(self._name(child), []).append(finding)
            off |= {self._name(child): far for one in kept for child, far in _off(one)}
            found += flooded(state)
        self._states = states
        self.judgement = Judgement(tuple(found), {frame: tuple(some) for frame, some in of_frame.items()}, off)
        return self.judgement

    def about(self, frame: str) -> list[str]:
        """Return what is known of the edge above a frame: a line for each publisher, then what is wrong."""
        lines = [line for one in self._states.get(frame, ()) for line in _published(one)]
        if not lines and frame in self._edges:
            lines = [f"nothing came from {self._edges[frame].owner} yet"]
        if frame in self.judgement.off:
            lines.append(f"off by {self.judgement.off[frame].text}")
        return lines + [f"{one.code} {one.message}" for one in self.judgement.of_frame.get(frame, ())]


def _counts(one: Difference, listened_s: float) -> bool:
    """Return whether it is so now: neither of somebody who has left, nor of what may still come."""
    if one.violation is not None and one.live is not None and one.live.present is False:
        return False
    return listened_s >= FOUND_S or one.code not in _MISSING


def _children(group: Sequence[Difference]) -> Iterator[str]:
    for one in group:
        if one.edge is not None:
            yield one.edge.child
        elif one.live is not None:
            yield one.live.child


def _off(one: Difference) -> Iterator[tuple[str, Offset]]:
    """Yield the frame that is not where the robot has it, and how far it is off."""
    if one.edge is None or one.live is None:
        return
    if one.off is not None:
        yield one.edge.child, one.off
    elif one.driver is not None:
        yield one.edge.child, offset_of(one.edge.pose, one.live.stream.pose)


def _published(edge: EdgeState) -> Iterator[str]:
    """Yield who publishes an edge, in which parent, how often, and how old the newest pose is."""
    kind = "fixed" if edge.stream.static else f"{edge.timing.rate:.3g} Hz" if edge.timing.rate else "once"
    age = edge.age_s if edge.data_age_s is None else edge.data_age_s
    gone = ", has left" if edge.present is False else ""
    yield f"{who(edge)} in {edge.parent}, {kind}, {duration(age)} old{gone}"
