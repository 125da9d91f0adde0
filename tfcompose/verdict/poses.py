"""How far poses are from what they should be, in millimetres and degrees, and edges that come with another pose."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from tfcompose.findings import Finding, Note, finding
from tfcompose.geometry import Pose, angle_between, normalised
from tfcompose.text import counted

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tfcompose.findings import Span
    from tfcompose.plan import PlanEdge

_LISTED = 12


class Offset(NamedTuple):
    """A distance in metres, and the angle of the one rotation between two orientations, in radians, 0 to π."""

    xyz_m: float
    rot_rad: float

    @property
    def text(self) -> str:
        """Both in millimetres and degrees, without what is nothing."""
        distance = f"{self.xyz_m * 1e3:.3g} mm" if self.xyz_m < 1 else f"{self.xyz_m:.3g} m"
        parts = [distance] if self.xyz_m >= _NO_MM else []
        parts += [f"{math.degrees(self.rot_rad):.3g} deg"] if self.rot_rad >= _NO_RAD else []
        return " and ".join(parts) or "nothing"

    def beyond(self, limit: Offset) -> bool:
        """Whether the distance or the angle is larger than that of ``limit``, by more than what computing adds."""
        return self.xyz_m > limit.xyz_m + _ROUNDING or self.rot_rad > limit.rot_rad + _ROUNDING


#: What two poses may be apart and count as the same.
DEFAULT_TOLERANCE = Offset(1e-3, math.radians(0.1))
_NO_MM, _NO_RAD = 1e-6, 1e-6
#: Metres and radians.
_ROUNDING = 1e-9


def offset_of(expected: Pose, observed: Pose) -> Offset:
    """Return how far ``observed`` is from ``expected``; quaternions need not be of length 1."""
    angle = angle_between(normalised(expected.quat_xyzw), normalised(observed.quat_xyzw))
    return Offset(math.dist(expected.xyz, observed.xyz), angle)


def shown(pose: Pose) -> str:
    """Return the pose in one line: metres, and fixed-axis angles in degrees."""
    xyz = " ".join(f"{round(value, 5) + 0.0:g}" for value in pose.xyz)
    angles = Pose(pose.xyz, normalised(pose.quat_xyzw)).rpy
    rpy = " ".join(f"{round(math.degrees(angle), 3) + 0.0:g}" for angle in angles)
    return f"xyz {xyz} m, rpy {rpy} deg"


def compared(expected: Pose, observed: Pose) -> str:
    """Return both poses as people read them."""
    return f"seen {shown(observed)}; expected {shown(expected)}"


def pose_differs(off: Sequence[tuple[PlanEdge, str, Pose]], publisher: str, place: Span | None = None) -> Finding:
    """Return the finding for edges that come with another pose than the plan's: each with its parent, as it was sent.

    ``publisher`` is empty where it is not known; ``place`` is where the first edge stands in the robot's file.
    """
    (edge, parent, pose), *others = off
    by = f" from {publisher}" if publisher else ""
    more = f", and of {counted(len(others), 'more frame')} too" if others else ""
    message = f"the pose of {edge.child} in {parent}{by} is off by {offset_of(edge.pose, pose).text}{more}"
    notes = [
        Note(f"{one.child} in {above} by {offset_of(one.pose, sent).text}: {compared(one.pose, sent)}")
        for one, above, sent in others[:_LISTED]
    ]
    notes += [] if place else [Note(f"{edge.name} is declared in {edge.source[0]}:{edge.source[1]}")]
    advice = "was it changed after the start? tfcompose restart; else correct the one that is wrong"
    return finding("TF846", f"{message}: {compared(edge.pose, pose)}", place, notes=notes, help=advice)
