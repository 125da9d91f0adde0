"""From positions to transforms, all joints at once.

The pose of a joint's edge is its pose at 0 followed by the motion (URDF). For a turn about the unit axis a that is
p₀, q₀·(a sin q/2, cos q/2) = cos q/2 · q₀ + sin q/2 · q₀·(a, 0); for a slide p₀ + q · R₀a, q₀. Both are linear in what
the position gives, so that no joint is computed by itself.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tfcompose.geometry import multiply, rotate
from tfcompose.ros.tf_codec import ArrayTemplate
from tfcompose.run.publishing.follow import SLIDING

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from tfcompose.plan import Joint, PlanEdge
    from tfcompose.run.publishing.follow import Followed


class Moving:
    """The edges that joint states with one list of names move, as one message.

    ``edges`` and ``joints`` are in the order of the indices in ``followed``; positions are in rad, or m for a prismatic
    joint.
    """

    def __init__(
        self, edges: Sequence[PlanEdge], joints: Sequence[Joint], followed: Sequence[Followed], names: Sequence[str]
    ) -> None:
        ordered = sorted(followed, key=lambda one: joints[one.joint].type in SLIDING)
        self._names = [names[one.column] for one in ordered]
        self._columns = np.array([one.column for one in ordered], np.intp)
        self._multiplier = np.array([one.multiplier for one in ordered])
        self._offset = np.array([one.offset for one in ordered])
        self._follows = any((one.multiplier, one.offset) != (1.0, 0.0) for one in ordered)
        moved = [(edges[one.joint], joints[one.joint]) for one in ordered]
        self._turning = turning = sum(joint.type not in SLIDING for _, joint in moved)
        self._message = ArrayTemplate([(e.parent, e.child) for e, _ in moved], [e.pose for e, _ in moved])
        self._quat_at = self._message.quat_at[:turning]
        self._xyz_at = self._message.xyz_at[turning:]
        poses = [(edge.pose, joint.axis) for edge, joint in moved]
        rotating, sliding = poses[:turning], poses[turning:]
        self._at_0 = _rows([pose.quat_xyzw for pose, _ in rotating], 4)
        self._turned = _rows([multiply(pose.quat_xyzw, (*axis, 0.0)) for pose, axis in rotating], 4)
        self._start = _rows([pose.xyz for pose, _ in sliding], 3)
        self._along = _rows([rotate(pose.quat_xyzw, axis) for pose, axis in sliding], 3)

    def message(self, positions: NDArray[np.float64], stamp_ns: int) -> bytes:
        """Return the TFMessage for these positions, in the order of the names, at this time in nanoseconds.

        Raises:
            ValueError: with a sentence that is the same for the same fault, if a position is not finite or a message
                cannot hold the time.
        """
        q = positions[self._columns].astype(np.float64, copy=False)
        if not np.isfinite(q).all():
            name = self._names[int(np.argmin(np.isfinite(q)))]
            raise ValueError(f"the position of {name} is not finite")
        if self._follows:
            q = q * self._multiplier + self._offset
        doubles, turning = self._message.doubles, self._turning
        if turning:
            half = 0.5 * q[:turning, np.newaxis]
            doubles[self._quat_at] = np.cos(half) * self._at_0 + np.sin(half) * self._turned
        if turning < len(q):
            doubles[self._xyz_at] = self._start + q[turning:, np.newaxis] * self._along
        return self._message.data(stamp_ns)


def _rows(rows: Sequence[tuple[float, ...]], width: int) -> NDArray[np.float64]:
    return np.array(rows, np.float64).reshape(-1, width)
