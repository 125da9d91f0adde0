"""An edge of the tree, the joint that moves it, the joint's limits, and a measured pose."""

from __future__ import annotations

import math
from dataclasses import MISSING, dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar

from tfcompose.foundation.geometry import Pose, angle_between, quat_from_axis_angle
from tfcompose.foundation.units import (  # noqa: TC001 (read by them)
    JointDamping,
    JointEffort,
    JointPosition,
    JointVelocity,
    Number,
)
from tfcompose.model.fields import documented_field, narrow
from tfcompose.model.plan import PlanEdge, PlanJoint, SourceLine

if TYPE_CHECKING:
    from collections.abc import Callable

    from tfcompose.foundation.findings import Edit, Span
    from tfcompose.model.plan import JointType

#: Types of joints: those that joint states move, those of these with limits, and those with more
#: than one position variable, which joint states do not describe.
MOVING: tuple[JointType, ...] = ("revolute", "continuous", "prismatic")
BOUNDED: tuple[JointType, ...] = ("revolute", "prismatic")
FREE: tuple[JointType, ...] = ("floating", "planar")


@dataclass(frozen=True, slots=True)
class Limit:
    """The limits of a joint: rad or m, N m or N, rad/s or m/s."""

    __pydantic_config__: ClassVar[dict[str, str]] = {"extra": "forbid"}

    lower: JointPosition | None = documented_field(None, "the lowest position")
    upper: JointPosition | None = documented_field(None, "the highest position")
    effort: JointEffort | None = documented_field(
        None, "the largest torque, or force of a prismatic joint"
    )
    velocity: JointVelocity | None = documented_field(None, "the largest speed")


@dataclass(frozen=True, slots=True)
class Dynamics:
    """Damping and friction of a joint: N m s/rad and N m, or N s/m and N."""

    __pydantic_config__: ClassVar[dict[str, str]] = {"extra": "forbid"}

    damping: JointDamping = documented_field(0.0, "the damping")
    friction: JointEffort = documented_field(0.0, "the static friction")


@dataclass(frozen=True, slots=True, kw_only=True)
class SafetyController:
    """Soft limits of a joint, and gains for a controller that enforces them."""

    __pydantic_config__: ClassVar[dict[str, str]] = {"extra": "forbid"}

    soft_lower_limit: JointPosition = documented_field(0.0, "the lower soft limit")
    soft_upper_limit: JointPosition = documented_field(0.0, "the upper soft limit")
    k_position: Number = documented_field(
        0.0, "the gain from position to velocity inside the soft limits"
    )
    k_velocity: Number = documented_field(MISSING, "the gain from velocity to effort", 10)


@dataclass(frozen=True, slots=True)
class ReferencePositions:
    """The positions at which a joint's reference switch changes; URDF's calibration."""

    __pydantic_config__: ClassVar[dict[str, str]] = {"extra": "forbid"}

    rising: JointPosition | None = documented_field(
        None, "the position at which the switch turns on"
    )
    falling: JointPosition | None = documented_field(
        None, "the position at which the switch turns off"
    )


#: Limits of joints may be rounded by this much, in rad or m, such as 1.57 rad for 90 deg.
ROUNDED = 2e-3


@dataclass(frozen=True, slots=True)
class Joint(PlanJoint):
    """A joint of the plan, with data that only the compiler needs.

    The axis of a planar joint is the plane's normal.
    """

    span: Span = field(kw_only=True)
    #: The span of the name of the joint that it mimics.
    mimic_at: Span | None = field(default=None, kw_only=True)
    #: Correction of the zero, in rad or m: the child is where ``q + zero_offset`` would place it.
    #: The edge's pose, the limits and the positions of followers include it.
    zero_offset: float = field(default=0.0, kw_only=True)
    limit: Limit | None = field(default=None, kw_only=True)
    #: The span of the limits.
    limit_at: Span | None = field(default=None, compare=False, kw_only=True)
    #: The length of the axis in the file.
    axis_length: float = field(default=1.0, kw_only=True)
    #: The span of the axis, None for the default axis.
    axis_at: Span | None = field(default=None, compare=False, kw_only=True)
    dynamics: Dynamics | None = field(default=None, kw_only=True)
    safety: SafetyController | None = field(default=None, kw_only=True)
    reference: ReferencePositions | None = field(default=None, kw_only=True)

    def motion(self, position: float) -> Pose:
        """Return the pose of the child at a position in rad or m, in the child at 0."""
        x, y, z = self.axis
        if self.type == "prismatic":
            return Pose((x * position, y * position, z * position))
        return Pose(quat_xyzw=quat_from_axis_angle(self.axis, position))

    def exceeded_limits(self, position: float) -> str:
        """Return the limits that a position in rad or m exceeds.

        Empty if it is within the limits.
        """
        limit = self.limit
        if self.type not in {"revolute", "prismatic"} or limit is None:
            return ""
        lower, upper = limit.lower, limit.upper
        if lower is None or upper is None or lower > upper:  # another finding reports it
            return ""
        is_within = lower - ROUNDED <= position <= upper + ROUNDED
        return "" if is_within else f"{self.in_unit(lower)} to {self.in_unit(upper)}"

    @property
    def zero_offset_text(self) -> str:
        """The correction of the zero in mm or degrees."""
        if self.type == "prismatic":
            return f"{self.zero_offset * 1000:.6g} mm"
        return f"{math.degrees(self.zero_offset):.6g} deg"

    def in_unit(self, position: float) -> str:
        """Return a position in rad or m as text, in deg or m."""
        return (
            f"{position:g} m" if self.type == "prismatic" else f"{math.degrees(position):.4g} deg"
        )


@dataclass(frozen=True, slots=True)
class Calibration:
    """A measured pose of ``child`` in ``parent``, frames of the robot."""

    parent: str
    child: str
    pose: Pose
    #: The pose in the calibration file.
    entry: Pose
    #: The entry in the calibration file.
    span: Span
    format: str
    #: The span in the robot file.
    named_at: Span
    #: Maximum distance from the nominal pose, in metres.
    limit_m: float
    #: Maximum angle from the nominal orientation, in radians.
    limit_rad: float
    #: Whether the entry is used in the opposite direction.
    inverted: bool = False
    #: The nominal pose from the robot file, if there is one.
    nominal: Pose | None = None

    @property
    def name(self) -> str:
        """The measurement for display: frames, direction and source."""
        turned = ", inverted" if self.inverted else ""
        source = f"from {self.span.file}:{self.span.line} ({self.format}{turned})"
        return f"pose of {self.child} in {self.parent}, {source}"

    def off(self, pose: Pose) -> tuple[float, float]:
        """Return the distance of ``pose`` from the nominal pose, in metres and radians.

        0 without a nominal pose.
        """
        if self.nominal is None:
            return (0.0, 0.0)
        far = math.dist(pose.xyz, self.nominal.xyz)
        return (far, angle_between(pose.quat_xyzw, self.nominal.quat_xyzw))


#: A rate of at least this fraction of the declared rate is accepted.
_NEARLY = 0.9


@dataclass(frozen=True, slots=True)
class Edge(PlanEdge):
    """An edge of the plan, with data that only the compiler needs."""

    #: The publishing node; empty if the owner has only one node.
    node: str = field(default="", kw_only=True)
    rate: float | None = field(default=None, kw_only=True)
    #: The line of ``span``.
    source: SourceLine = field(init=False, compare=False, repr=False)
    #: The joint whose states move the edge.
    joint: Joint | None = field(default=None, kw_only=True)
    #: The span of the declaration.
    span: Span = field(kw_only=True)
    joint_name: str = field(default="", kw_only=True)
    #: Whether the robot file declares it; the frames inside a sensor come from its preset.
    declared: bool = field(default=True, kw_only=True)
    #: The path of the mapping that declares the edge. For an edge inside a part, it begins with
    #: the part's path.
    entry: tuple[str | int, ...] = field(default=(), compare=False, kw_only=True)
    owner_at: Span | None = field(default=None, kw_only=True)
    child_at: Span | None = field(default=None, kw_only=True)
    joint_at: Span | None = field(default=None, kw_only=True)
    #: The span of its position, if it has one.
    xyz_at: Span | None = field(default=None, kw_only=True)
    sensor: str | None = field(default=None, kw_only=True)
    nominal: bool = field(default=False, kw_only=True)
    rate_at: Span | None = field(default=None, kw_only=True)
    calibration: Calibration | None = field(default=None, kw_only=True)
    #: A planar or floating joint, which joint states cannot move.
    free: Joint | None = field(default=None, kw_only=True)
    #: Whether the vendor's name for the frame hides or misstates that the frame is optical.
    other_axes: bool = field(default=False, kw_only=True)
    #: Returns edits of the file that give the edge the optical rotation of REP-103; empty if that
    #: is not safe.
    optical_edits: Callable[[], tuple[Edit, ...]] = field(
        default=tuple, compare=False, repr=False, kw_only=True
    )

    def __post_init__(self) -> None:
        object.__setattr__(self, "source", SourceLine(self.span.file, self.span.line))

    @property
    def mount(self) -> Pose:
        """The pose without the offset of the joint's zero."""
        if self.joint is None or not self.joint.zero_offset:
            return self.pose
        return self.pose @ self.joint.motion(-self.joint.zero_offset)

    def is_slower(self, rate: float) -> bool:
        """Return whether a rate in Hz is below the declared rate, as the guard judges it."""
        return self.rate is not None and rate < _NEARLY * self.rate

    def to_plan(self, **made: Any) -> PlanEdge:
        """Return the edge in the form of the plan.

        The form includes fields that depend on the complete robot.
        """
        return narrow(PlanEdge, self, **made)
