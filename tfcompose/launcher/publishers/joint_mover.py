"""Conversion of serialised joint states to serialised TF messages.

Unusable joint states are reported and dropped.

The pose of a joint's edge is its pose at position 0, followed by the motion (URDF). For a rotation
about the unit axis a this is p₀, q₀·(a sin q/2, cos q/2) = cos q/2 · q₀ + sin q/2 · q₀·(a, 0). For
a translation it is p₀ + q · R₀a, q₀. Both are linear in functions of the position, so all joints
can be computed at once.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from tfcompose.foundation.geometry import multiply, rotate
from tfcompose.launcher.publishers.mimics import SLIDING, TURNING, Joints
from tfcompose.tf.ros.joint_codec import read_names
from tfcompose.tf.ros.tf_codec import ArrayTemplate

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from tfcompose.launcher.publishers.mimics import Followed
    from tfcompose.model.plan import PlanEdge, PlanJoint
    from tfcompose.tf.ros.joint_codec import JointNames

_SECOND_NS = 1_000_000_000
# Maximum number of different lists of names to remember. Usually each driver sends its own list. A
# driver that never repeats a list must not fill the memory.
_MOST_SOURCES = 64
# Maximum number of different lines about faults. Each line, which may contain a name, is printed
# once.
_MOST_LINES = 64


@dataclass(frozen=True, slots=True)
class PublishOptions:
    """Options for publishing joint states, named like robot_state_publisher's parameters."""

    #: Maximum rate, in Hz, of joint states with the same names; 0 for no limit.
    publish_frequency: float = 0.0
    #: Whether to publish regardless of stamps: repeated stamps, and rates above the maximum.
    ignore_timestamp: bool = False


def positions_of(names: JointNames, data: bytes) -> NDArray[np.float64]:
    """Return the positions in a message with these names: rad or m, shape (names,).

    Raises:
        ValueError: if the message has a different number of positions.
    """
    offset = names.positions_at(data)
    return np.frombuffer(data, f"{names.order}f8", len(names.names), offset)


@dataclass(slots=True)
class _Source:
    """Joint states with the same list of names, and their newest stamp in nanoseconds."""

    names: JointNames
    moving: JointGroup | None
    last_ns: int | None = None
    due_ns: int = 0


class JointMover:
    """Converts joint states for the moving edges of a plan.

    ``say`` receives lines for the user. Messages sent by hand often have no stamp. For these,
    ``now_ns`` returns the time in nanoseconds for a message that arrived at a given time, or None
    if no time is known yet.
    """

    def __init__(
        self,
        edges: Sequence[PlanEdge],
        say: Callable[[str], None],
        now_ns: Callable[[int], int | None],
        options: PublishOptions | None = None,
    ) -> None:
        pairs = [(edge, edge.joint) for edge in edges if edge.joint]
        movable = [(edge, joint) for edge, joint in pairs if joint.type in TURNING + SLIDING]
        self._edges = [edge for edge, _ in movable]
        self._all_joints = [joint for _, joint in movable]
        self._joints = Joints(self._all_joints)
        self._say = say
        self._now_ns = now_ns
        options = options or PublishOptions()
        self._ignores_time = options.ignore_timestamp
        self._period_ns = (
            round(_SECOND_NS / options.publish_frequency) if options.publish_frequency else 0
        )
        self._sources: list[_Source] = []
        self._reported: set[str] = set()
        self._moved: set[int] = set()
        for edge, joint in pairs:
            if joint.type not in TURNING + SLIDING:
                say(
                    f"{edge.name} is not published: a {joint.type} joint has no single position in"
                    " joint states"
                )

    def __len__(self) -> int:
        return len(self._edges)

    @property
    def missing(self) -> list[str]:
        """Joints that no joint state has moved yet, without joints that mimic one of them."""
        names = {
            joint.name for index, joint in enumerate(self._all_joints) if index not in self._moved
        }
        return [
            joint.name
            for joint in self._all_joints
            if joint.name in names and joint.mimic not in names
        ]

    def tf_message(self, data: bytes, received_ns: int) -> bytes | None:
        """Return a joint state as a TFMessage, None if it moves no joint."""
        try:
            source = self._source(data)
            if source.moving is None:
                return None
            positions = positions_of(source.names, data)
            stamp_ns = source.names.stamp_ns(data) or self._now_ns(received_ns)
            if stamp_ns is None or not self._is_due(source, stamp_ns):
                return None
            return source.moving.message(positions, stamp_ns)
        except ValueError as error:
            self._once(f"dropped a joint state: {error} (reported once)")
            return None

    def _source(self, data: bytes) -> _Source:
        for source in self._sources:
            if source.names.fit(data):
                return source
        names = read_names(data)
        names.positions_at(data)
        for source in self._sources:
            if source.names.names == names.names:  # the frame or padding bytes differ
                source.names = names
                return source
        if len(self._sources) >= _MOST_SOURCES:
            self._sources.clear()
        followed = self._joints.follow(names.names)
        moving = (
            JointGroup(self._edges, self._all_joints, followed, names.names) if followed else None
        )
        self._moved |= {joint.joint for joint in followed}
        self._sources.append(_Source(names, moving))
        return self._sources[-1]

    def _is_due(self, source: _Source, stamp_ns: int) -> bool:
        """Return whether to publish a joint state with this stamp, and record the stamp.

        tf2 accepts only the first transform with a given stamp, and every listener warns about
        further ones. An earlier stamp comes from a recording that starts again, or from a second
        source. Such a joint state is published, because tf2 sorts transforms by stamp.
        """
        if self._ignores_time:
            return True
        if stamp_ns == source.last_ns:
            self._once(
                "skipped a joint state with the same stamp as the previous one (reported once)"
            )
            return False
        # A message may be up to half a period early. The next due time is a period after the
        # previous due time, so jitter of the source drops no messages and the mean rate stays.
        early_ns = source.due_ns - self._period_ns // 2
        if self._period_ns and source.last_ns is not None and source.last_ns < stamp_ns < early_ns:
            hertz = _SECOND_NS / self._period_ns
            self._once(
                f"joint states arrive at more than {hertz:g} Hz: some are skipped"
                " (publish_frequency)"
            )
            return False
        behind = (
            source.last_ns is None
            or stamp_ns < source.last_ns
            or stamp_ns - source.due_ns > self._period_ns
        )
        source.due_ns = (stamp_ns if behind else source.due_ns) + self._period_ns
        source.last_ns = stamp_ns
        return True

    def _once(self, line: str) -> None:
        if line not in self._reported and len(self._reported) < _MOST_LINES:
            self._reported.add(line)
            self._say(line)


class JointGroup:
    """The edges that joint states with a given list of names move, as a TF message.

    ``edges`` and ``joints`` have the order of the indices in ``followed``. Positions are in rad,
    or in m for a prismatic joint.
    """

    def __init__(
        self,
        edges: Sequence[PlanEdge],
        joints: Sequence[PlanJoint],
        followed: Sequence[Followed],
        names: Sequence[str],
    ) -> None:
        ordered = sorted(followed, key=lambda joint: joints[joint.joint].type in SLIDING)
        self._names = [names[joint.column] for joint in ordered]
        self._columns = np.array([joint.column for joint in ordered], np.intp)
        self._multiplier = np.array([joint.multiplier for joint in ordered])
        self._offset = np.array([joint.offset for joint in ordered])
        self._follows = any((joint.multiplier, joint.offset) != (1.0, 0.0) for joint in ordered)
        moved = [(edges[joint.joint], joints[joint.joint]) for joint in ordered]
        self._turning = turning = sum(joint.type not in SLIDING for _, joint in moved)
        self._message = ArrayTemplate(
            [(e.parent, e.child) for e, _ in moved], [e.pose for e, _ in moved]
        )
        # A row for each component and a column for each joint, because numpy is fast along long
        # rows.
        self._quat_at = self._message.quat_at[:turning].T.copy()
        self._xyz_at = self._message.xyz_at[turning:].T.copy()
        poses = [(edge.pose, joint.axis) for edge, joint in moved]
        rotating, sliding = poses[:turning], poses[turning:]
        self._at_0 = _columns([pose.quat_xyzw for pose, _ in rotating], 4)
        self._turned = _columns(
            [multiply(pose.quat_xyzw, (*axis, 0.0)) for pose, axis in rotating], 4
        )
        self._start = _columns([pose.xyz for pose, _ in sliding], 3)
        self._along = _columns([rotate(pose.quat_xyzw, axis) for pose, axis in sliding], 3)

    def message(self, positions: NDArray[np.float64], stamp_ns: int) -> bytes:
        """Return the TFMessage for positions, in the order of the names, with a stamp in ns.

        Raises:
            ValueError: if a position is not finite, or the message type cannot hold the time. A
                fault always has the same text.
        """
        q = positions[self._columns].astype(np.float64, copy=False)
        if not np.isfinite(q).all():
            name = self._names[int(np.argmin(np.isfinite(q)))]
            raise ValueError(f"the position of {name} is not finite")
        if self._follows:
            q = q * self._multiplier + self._offset
        doubles, turning = self._message.doubles, self._turning
        if turning:
            half = 0.5 * q[:turning]
            doubles[self._quat_at] = np.cos(half) * self._at_0 + np.sin(half) * self._turned
        if turning < len(q):
            doubles[self._xyz_at] = self._start + q[turning:] * self._along
        return self._message.data(stamp_ns)


def _columns(columns: Sequence[tuple[float, ...]], height: int) -> NDArray[np.float64]:
    made: NDArray[np.float64] = np.array(columns, np.float64).reshape(-1, height).T.copy()
    return made
