"""Fast computation of the poses of many frames in the roots of their trees.

A pose is a row of seven numbers: x, y, z in metres, then the unit quaternion x, y, z, w. The poses
of all frames at the same depth are computed in a single array operation.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from tfcompose.foundation.geometry import Pose

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    Rows = NDArray[np.float64]

IDENTITY = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


class FrameForest:
    """The trees that frames and their parents form.

    If frames form a loop, a frame of the loop counts as a root.
    """

    def __init__(self, frames: Sequence[str], parents: Mapping[str, str]) -> None:
        self.frames = tuple(frames)
        self.index = {frame: row for row, frame in enumerate(self.frames)}
        depths = _depths(self.frames, parents)
        by_depth: dict[int, list[tuple[int, int]]] = {}
        for frame, depth in depths.items():
            if depth:
                by_depth.setdefault(depth, []).append(
                    (self.index[frame], self.index[parents[frame]])
                )
        self._levels = [np.array(by_depth[depth], np.intp).T for depth in sorted(by_depth)]
        self._roots = np.array(
            [self.index[frame] for frame, depth in depths.items() if not depth], np.intp
        )
        self._root_of = np.arange(len(self.frames))
        for rows, above in self._levels:
            self._root_of[rows] = self._root_of[above]

    def in_roots(self, local: Rows) -> Rows:
        """Return the pose of each frame in its root, shape (frames, 7)."""
        in_root: Rows = local.copy()
        in_root[self._roots] = IDENTITY
        for rows, above in self._levels:
            in_root[rows] = _product(in_root[above], local[rows])
        return in_root

    def in_frame(self, frame: str, in_roots: Rows, poses: Rows) -> Rows:
        """Return ``poses`` relative to a frame.

        ``poses`` and ``in_roots`` are poses in the root of the frame's tree. ``in_roots``
        contains the pose of the frame itself.
        """
        same = self._root_of == self._root_of[self.index[frame]]
        inverse = np.array([row_of(pose_of(in_roots[self.index[frame]].tolist()).inverse())])
        rows: Rows = poses.copy()
        rows[same] = _product(np.repeat(inverse, int(same.sum()), axis=0), poses[same])
        return rows

    def below(self, frames: set[str]) -> set[str]:
        """Return these frames and all frames below them."""
        reached = np.zeros(len(self.frames), bool)
        reached[[self.index[frame] for frame in frames if frame in self.index]] = True
        for rows, above in self._levels:
            reached[rows] |= reached[above]
        return {self.frames[row] for row in np.flatnonzero(reached)}


def _depths(frames: Sequence[str], parents: Mapping[str, str]) -> dict[str, int]:
    """Return the number of edges between each frame and its root."""
    names = frozenset(frames)
    depths: dict[str, int] = {}
    for frame in frames:
        chain: dict[str, None] = {}
        ancestor = frame
        while ancestor not in depths and ancestor not in chain:
            chain[ancestor] = None
            above = parents.get(ancestor)
            if above is None or above not in names:
                depths[ancestor] = 0
                break
            ancestor = above
        if ancestor not in depths:  # a loop
            depths[ancestor] = 0
        for name in reversed(chain):
            if name not in depths:
                depths[name] = depths[parents[name]] + 1
    return depths


def _product(a: Rows, b: Rows) -> Rows:
    """Return the poses a·b, row by row."""
    ax, ay, az, aw = a[:, 3:].T
    bx, by, bz, bw = b[:, 3:].T
    out = np.empty_like(b)
    axis, moved = a[:, 3:6], b[:, :3]
    twice = 2 * np.cross(axis, moved)
    out[:, :3] = a[:, :3] + moved + aw[:, None] * twice + np.cross(axis, twice)
    out[:, 3] = aw * bx + ax * bw + ay * bz - az * by
    out[:, 4] = aw * by - ax * bz + ay * bw + az * bx
    out[:, 5] = aw * bz + ax * by - ay * bx + az * bw
    out[:, 6] = aw * bw - ax * bx - ay * by - az * bz
    out[:, 3:] /= np.linalg.norm(out[:, 3:], axis=1)[:, None]
    return out


def pose_of(row: Any) -> Pose:
    """Return a row as a pose."""
    x, y, z, qx, qy, qz, qw = row
    return Pose((x, y, z), (qx, qy, qz, qw))


def poses_of(rows: Rows) -> list[Pose]:
    """Return rows as poses."""
    return [Pose((x, y, z), (qx, qy, qz, qw)) for x, y, z, qx, qy, qz, qw in rows.tolist()]


def row_of(pose: Pose) -> tuple[float, ...]:
    """Return a pose as a row."""
    return (*pose.xyz, *pose.quat_xyzw)
