"""Picture of a tree: the pose of each frame in a scene, from its newest transforms."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from tfcompose.foundation.geometry import Pose
from tfcompose.tools.view.forest import FrameForest, pose_of, poses_of, row_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from tfcompose.model.robot import Robot
    from tfcompose.tf.ros.tf_codec import Row
    from tfcompose.tools.view.forest import Rows
    from tfcompose.tools.view.judgement import Judgement

_TURNING = frozenset({"revolute", "continuous"})


@dataclass(frozen=True, slots=True)
class Picture:
    """The poses of all frames, in the roots of their trees or in the fixed frame."""

    #: The robot with the published parents.
    robot: Robot
    #: Poses of the robot's frames. A frame that was not published is at its pose in the robot.
    poses: Mapping[str, Pose]
    #: Poses of frames that are not the robot's.
    further: Mapping[str, Pose] = field(default_factory=dict)
    #: Expected poses of frames that are elsewhere, and of all frames below them.
    ghosts: Mapping[str, Pose] = field(default_factory=dict)
    #: Edges (parent, child) with a fault.
    wrong: tuple[tuple[str, str], ...] = ()


class Pictures:
    """Makes pictures of a robot.

    Frames have the names of its file, which may differ on the tree. Frames in one tree with the
    ``fixed`` frame are shown in that frame; empty: in their root.
    """

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self.fixed = ""
        self.edges = {
            edge.child: edge for edge in reversed(robot.edges)
        }  # of several parents the first
        self._names = {robot.final(frame): frame for frame in robot.frames}
        self._rows: dict[str, Row] = {}
        self._judged: object = None
        self._grow({edge.child: edge.parent for edge in self.edges.values()})

    def name(self, frame: str) -> str:
        """Return the robot file's name for a frame on the tree; other frames keep theirs."""
        return self._names.get(frame, frame)

    def next(self, newest: Mapping[str, Row], judgement: Judgement) -> Picture | None:
        """Return the newest transforms by frame, or None if nothing changed."""
        parents = {edge.child: edge.parent for edge in self.edges.values()}
        parents |= {child: self.name(row[0].removeprefix("/")) for child, row in newest.items()}
        if parents != self._parents or not self._rows.keys() <= newest.keys():
            self._grow(parents)
        changed = {child: row for child, row in newest.items() if self._rows.get(child) is not row}
        judged = (judgement.wrong, frozenset(judgement.off), self.fixed)
        if not changed and self._judged == judged:
            return None
        self._judged = judged
        if changed:
            self._rows |= changed
            rows = [self._forest.index[child] for child in changed]
            self._local[rows] = [row[4:11] for row in changed.values()]
        return self._picture(judgement)

    def _grow(self, parents: dict[str, str]) -> None:
        """Take the parents of frames, and begin with the poses that the robot has."""
        self._parents = parents
        frames = dict.fromkeys([*self.robot.frames, *parents, *parents.values()])
        self._forest = FrameForest(tuple(frames), parents)
        poses = {child: edge.pose for child, edge in self.edges.items()}
        rows = [row_of(poses.get(frame, Pose())) for frame in frames]
        self._local = np.array(rows, np.float64).reshape(-1, 7)
        self._rows = {}
        self._judged = None
        edges = tuple(
            replace(edge, parent=parents.get(edge.child, edge.parent)) for edge in self.robot.edges
        )
        self._shown = replace(self.robot, edges=edges)

    def _picture(self, judgement: Judgement) -> Picture:
        in_roots = self._forest.in_roots(self._local)
        rows = self._transform_to_fixed(in_roots, in_roots)
        placed = dict(zip(self._forest.frames, poses_of(rows), strict=True))
        known = self.robot.frames
        poses = {frame: placed[frame] for frame in known}
        further = {frame: pose for frame, pose in placed.items() if frame not in known}
        wrong = tuple(
            (self._parents[frame], frame)
            for frame in sorted(judgement.wrong)
            if frame in self._parents
        )
        return Picture(self._shown, poses, further, self._ghosts(judgement, in_roots), wrong)

    def _transform_to_fixed(self, in_roots: Rows, others: Rows) -> Rows:
        return (
            self._forest.in_frame(self.fixed, in_roots, others)
            if self.fixed in self._forest.index
            else others
        )

    def _ghosts(self, judgement: Judgement, in_roots: Rows) -> dict[str, Pose]:
        off = judgement.off.keys() & self.edges.keys() & self._forest.index.keys()
        if not off:
            return {}
        placed_local = self._local.copy()
        for child in off:
            row = self._forest.index[child]
            placed_local[row] = row_of(
                self._planned_pose(child, pose_of(self._local[row].tolist()))
            )
        placed = self._transform_to_fixed(in_roots, self._forest.in_roots(placed_local))
        frames = self._forest.below(set(off))
        return {
            frame: pose_of(placed[self._forest.index[frame]].tolist()) for frame in sorted(frames)
        }

    def _planned_pose(self, child: str, live: Pose) -> Pose:
        """Return where the robot has the frame in its parent.

        What a joint moves is where it was published.
        """
        edge = self.edges[child]
        if edge.joint is None:
            return edge.pose
        if edge.joint.type in _TURNING:
            return Pose(edge.pose.xyz, live.quat_xyzw)
        return Pose(live.xyz, edge.pose.quat_xyzw)


class ShownTree(ABC):
    """A tree of transforms, shown and judged: live, or at a time of a recording."""

    judgement: Judgement

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self._pictures = Pictures(robot)

    @property
    def fixed(self) -> str:
        """The frame in which its tree is shown; empty: the root."""
        return self._pictures.fixed

    @fixed.setter
    def fixed(self, frame: str) -> None:
        self._pictures.fixed = frame

    def next_picture(self) -> Picture | None:
        """Return all poses if a frame moved or its judgement changed, else None."""
        return self._pictures.next(self._newest(), self.judgement)

    @abstractmethod
    def about(self, frame: str) -> list[str]:
        """Return text about the edge above a frame, then findings."""

    @abstractmethod
    def _newest(self) -> Mapping[str, Row]:
        """Return the newest transform of each frame, by its name in the robot's file."""
