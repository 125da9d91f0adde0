"""An edge of the tree, and a pose that was measured."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from tfcompose.geometry import angle_between

if TYPE_CHECKING:
    from collections.abc import Callable

    from tfcompose.findings import Edit, Span
    from tfcompose.geometry import Pose
    from tfcompose.model.joint import Joint
    from tfcompose.plan import EdgeKind


@dataclass(frozen=True, slots=True)
class Calibration:
    """A pose that was measured: that of ``child`` in ``parent``, frames of the robot.

    ``nominal`` is the same by the pose that is written beside it, if one is. ``named_at`` is the place in the robot
    file, ``at`` the entry in the calibration file, ``entry`` its pose as it stands there; ``inverted`` says that it was
    taken the other way round. The limits (m, rad) say how far from nominal is too far.
    """

    parent: str
    child: str
    pose: Pose
    entry: Pose
    at: Span
    format: str
    named_at: Span
    limit_m: float
    limit_rad: float
    inverted: bool = False
    nominal: Pose | None = None

    @property
    def name(self) -> str:
        """The measurement, its direction and its source, as people read them."""
        turned = ", inverted" if self.inverted else ""
        source = f"from {self.at.file}:{self.at.line} ({self.format}{turned})"
        return f"pose of {self.child} in {self.parent}, {source}"

    def off(self, pose: Pose) -> tuple[float, float]:
        """Return how far ``pose`` is from the nominal one, in metres and radians; 0 if there is none."""
        if self.nominal is None:
            return (0.0, 0.0)
        far = math.dist(pose.xyz, self.nominal.xyz)
        return (far, angle_between(pose.quat_xyzw, self.nominal.quat_xyzw))


@dataclass(frozen=True, slots=True)
class Edge:
    """A frame and its parent, and who publishes where the one is in the other.

    ``switched`` holds the further parents between which the owner may change it, as a tool changer does; ``parent`` is
    the nominal one.
    ``joint`` moves by joint states. ``free`` is a planar or floating joint, of which joint states say nothing.
    ``other_axes``: the vendor's name for the frame does not say whether it is optical, or says it wrongly. ``node`` is
    the full name of the node that publishes the edge, where the owner has several. ``optical_edits`` returns the edits
    of the file that give the edge the optical rotation of REP-103; none where that is not safe.
    """

    parent: str
    child: str
    kind: EdgeKind
    pose: Pose
    owner: str
    at: Span
    rate: float | None = None
    joint: Joint | None = None
    joint_name: str = ""
    given: bool = True
    owner_at: Span | None = None
    child_at: Span | None = None
    joint_at: Span | None = None
    sensor: str | None = None
    nominal: bool = False
    rate_at: Span | None = None
    calibration: Calibration | None = None
    switched: tuple[str, ...] = ()
    free: Joint | None = None
    other_axes: bool = False
    node: str = ""
    optical_edits: Callable[[], tuple[Edit, ...]] = field(default=tuple, compare=False, repr=False)

    @property
    def name(self) -> str:
        """The edge as people read it."""
        return f"{self.parent} → {self.child}"
