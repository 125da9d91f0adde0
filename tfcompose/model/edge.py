"""An edge of the tree, and a pose that was measured."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from tfcompose.geometry import angle_between
from tfcompose.plan import PlanEdge, SourceLine
from tfcompose.plan.codec import narrowed

if TYPE_CHECKING:
    from collections.abc import Callable

    from tfcompose.findings import Edit, Span
    from tfcompose.geometry import Pose
    from tfcompose.model.joint import Joint


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
class Edge(PlanEdge):
    """An edge of the plan, with what only the compiler knows of it.

    ``at`` is where it was written, and ``source`` the line of that. ``node`` is empty where the owner has one node.
    ``joint`` moves by joint states. ``free`` is a planar or floating joint, of which joint states say nothing.
    ``other_axes``: the vendor's name for the frame does not say whether it is optical, or says it wrongly.
    ``optical_edits`` returns the edits of the file that give the edge the optical rotation of REP-103; none where that
    is not safe.
    """

    node: str = field(default="", kw_only=True)
    rate: float | None = field(default=None, kw_only=True)
    source: SourceLine = field(init=False, compare=False, repr=False)
    joint: Joint | None = field(default=None, kw_only=True)
    at: Span = field(kw_only=True)
    joint_name: str = field(default="", kw_only=True)
    given: bool = field(default=True, kw_only=True)
    owner_at: Span | None = field(default=None, kw_only=True)
    child_at: Span | None = field(default=None, kw_only=True)
    joint_at: Span | None = field(default=None, kw_only=True)
    sensor: str | None = field(default=None, kw_only=True)
    nominal: bool = field(default=False, kw_only=True)
    rate_at: Span | None = field(default=None, kw_only=True)
    calibration: Calibration | None = field(default=None, kw_only=True)
    free: Joint | None = field(default=None, kw_only=True)
    other_axes: bool = field(default=False, kw_only=True)
    optical_edits: Callable[[], tuple[Edit, ...]] = field(default=tuple, compare=False, repr=False, kw_only=True)

    def __post_init__(self) -> None:
        object.__setattr__(self, "source", SourceLine(self.at.file, self.at.line))

    def planned(self, **made: Any) -> PlanEdge:
        """Return the edge as the plan has it, with fields that follow from the whole robot."""
        return narrowed(PlanEdge, self, **made)
