"""Pose of each frame in a scene, computed from the newest transforms of a tree."""

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
    """The poses of all frames at a time, in the roots of their trees or in the fixed frame."""

    #: The robot with the published parents.
    robot: Robot
    #: Poses of the robot's frames. A frame without a transform is at its planned pose.
    poses: Mapping[str, Pose]
    #: Poses of frames that the robot file does not declare.
    further: Mapping[str, Pose] = field(default_factory=dict)
    #: The expected poses of frames that have another pose, and of all frames below them.
    ghosts: Mapping[str, Pose] = field(default_factory=dict)
    #: Edges (parent, child) with a fault.
    wrong: tuple[tuple[str, str], ...] = ()


class Pictures:
    """Makes pictures of a robot.

    Frames have their names from the robot file, which may differ from their names in the running
    tree. The poses of frames in the tree of ``fixed`` are relative to this frame. If ``fixed`` is
    empty, and in other trees, poses are relative to the root.
    """

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self.fixed = ""
        self.edges = {
            edge.child: edge for edge in reversed(robot.edges)
        }  # a frame with several parents uses the first
        self._names = {robot.final(frame): frame for frame in robot.frames}
        self._rows: dict[str, Row] = {}
        self._judged: object = None
        self._grow({edge.child: edge.parent for edge in self.edges.values()})

    def name(self, frame: str) -> str:
        """Return the name in the robot file for a frame of the tree.

        A frame that is not in the robot file keeps its name.
        """
        return self._names.get(frame, frame)

    def next(self, newest: Mapping[str, Row], judgement: Judgement) -> Picture | None:
        """Return a picture of the newest transforms, or None if nothing changed."""
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
        """Set the parents of frames, and start with the planned poses."""
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
        self._robot_of_edges = replace(self.robot, edges=edges)

    def _picture(self, judgement: Judgement) -> Picture:
        in_roots = self._forest.in_roots(self._local)
        rows = self._transform_to_fixed(in_roots, in_roots)
        placed = dict(zip(self._forest.frames, poses_of(rows), strict=True))
        frames = self.robot.frames
        poses = {frame: placed[frame] for frame in frames}
        further = {frame: pose for frame, pose in placed.items() if frame not in frames}
        wrong = tuple(
            (self._parents[frame], frame)
            for frame in sorted(judgement.wrong)
            if frame in self._parents
        )
        return Picture(
            self._robot_of_edges, poses, further, self._ghosts(judgement, in_roots), wrong
        )

    def _transform_to_fixed(self, in_roots: Rows, poses: Rows) -> Rows:
        return (
            self._forest.in_frame(self.fixed, in_roots, poses)
            if self.fixed in self._forest.index
            else poses
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
        """Return the planned pose of a frame in its parent.

        If a joint moves the frame, return the pose for the published joint position.
        """
        edge = self.edges[child]
        if edge.joint is None:
            return edge.pose
        if edge.joint.type in _TURNING:
            return Pose(edge.pose.xyz, live.quat_xyzw)
        return Pose(live.xyz, edge.pose.quat_xyzw)


class ShownTree(ABC):
    """A tree of transforms with findings: a running tree, or a recording at a time."""

    judgement: Judgement

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self._pictures = Pictures(robot)

    @property
    def fixed(self) -> str:
        """The frame in which the poses of its tree are shown; empty for the root."""
        return self._pictures.fixed

    @fixed.setter
    def fixed(self, frame: str) -> None:
        self._pictures.fixed = frame

    def next_picture(self) -> Picture | None:
        """Return all poses if a frame moved or its judgement changed, else None."""
        return self._pictures.next(self._newest(), self.judgement)

    def show_robot(self, robot: Robot) -> None:
        """Show another version of the robot, with the same frames and other poses."""
        self.robot = robot
        fixed, self._pictures = self.fixed, Pictures(robot)
        self.fixed = fixed

    @abstractmethod
    def about(self, frame: str) -> list[str]:
        """Return text about the edge above a frame, then its findings."""

    @abstractmethod
    def _newest(self) -> Mapping[str, Row]:
        """Return the newest transform of each frame, by its name in the robot's file."""
