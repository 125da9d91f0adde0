"""A joint that can move, and what it can bear."""

from __future__ import annotations

from dataclasses import MISSING, dataclass, field
from typing import TYPE_CHECKING, ClassVar

from tfcompose.plan import Joint as PlanJoint
from tfcompose.plan.codec import documented
from tfcompose.units import JointDamping, JointEffort, JointPosition, JointVelocity, Number  # noqa: TC001 (read by them)

if TYPE_CHECKING:
    from tfcompose.findings import Span
    from tfcompose.plan import JointType

#: Joints that joint states move; those of them that have ends; and those that have more than one position, of which
#: joint states say nothing.
MOVING: tuple[JointType, ...] = ("revolute", "continuous", "prismatic")
BOUNDED: tuple[JointType, ...] = ("revolute", "prismatic")
FREE: tuple[JointType, ...] = ("floating", "planar")


@dataclass(frozen=True, slots=True)
class Limit:
    """What a joint can do: rad or m, N m or N, rad/s or m/s."""

    __pydantic_config__: ClassVar[dict[str, str]] = {"extra": "forbid"}

    lower: JointPosition | None = documented(None, "the lowest position")
    upper: JointPosition | None = documented(None, "the highest position")
    effort: JointEffort | None = documented(None, "the largest torque, or force of a prismatic joint")
    velocity: JointVelocity | None = documented(None, "the largest speed")


@dataclass(frozen=True, slots=True)
class Dynamics:
    """What slows a joint down: N m s/rad and N m, or N s/m and N."""

    __pydantic_config__: ClassVar[dict[str, str]] = {"extra": "forbid"}

    damping: JointDamping = documented(0.0, "the damping")
    friction: JointEffort = documented(0.0, "the static friction")


@dataclass(frozen=True, slots=True, kw_only=True)
class SafetyController:
    """Where a controller begins to hold a joint back before its limits, and how hard."""

    __pydantic_config__: ClassVar[dict[str, str]] = {"extra": "forbid"}

    soft_lower_limit: JointPosition = documented(0.0, "where the lower soft limit begins")
    soft_upper_limit: JointPosition = documented(0.0, "where the upper soft limit begins")
    k_position: Number = documented(0.0, "the gain from position to velocity inside the soft limits")
    k_velocity: Number = documented(MISSING, "the gain from velocity to effort", 10)


@dataclass(frozen=True, slots=True)
class ReferencePositions:
    """Where a joint's reference switch changes; URDF calls it calibration."""

    __pydantic_config__: ClassVar[dict[str, str]] = {"extra": "forbid"}

    rising: JointPosition | None = documented(None, "where the switch goes on")
    falling: JointPosition | None = documented(None, "where the switch goes off")


@dataclass(frozen=True, slots=True)
class Joint(PlanJoint):
    """A joint of the plan, with what only the compiler knows of it; the axis of a planar one is the plane's normal.

    ``axis_length`` is that of the axis as it was written.
    """

    at: Span = field(kw_only=True)
    limit: Limit | None = field(default=None, kw_only=True)
    axis_length: float = field(default=1.0, kw_only=True)
    dynamics: Dynamics | None = field(default=None, kw_only=True)
    safety: SafetyController | None = field(default=None, kw_only=True)
    reference: ReferencePositions | None = field(default=None, kw_only=True)
