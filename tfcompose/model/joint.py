"""A joint that can move, and what it can bear."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tfcompose.findings import Span
    from tfcompose.geometry import Vector
    from tfcompose.plan import JointType

#: Joints that joint states move; those of them that have ends; and those that have more than one position, of which
#: joint states say nothing.
MOVING: tuple[JointType, ...] = ("revolute", "continuous", "prismatic")
BOUNDED: tuple[JointType, ...] = ("revolute", "prismatic")
FREE: tuple[JointType, ...] = ("floating", "planar")


@dataclass(frozen=True, slots=True)
class Limit:
    """What a joint can do: rad or m, N m or N, rad/s or m/s."""

    lower: float | None = None
    upper: float | None = None
    effort: float | None = None
    velocity: float | None = None


@dataclass(frozen=True, slots=True)
class Dynamics:
    """What slows a joint down: N m s/rad and N m, or N s/m and N."""

    damping: float = 0.0
    friction: float = 0.0


@dataclass(frozen=True, slots=True)
class SafetyController:
    """Where a controller begins to hold a joint back, and how hard."""

    soft_lower_limit: float = 0.0
    soft_upper_limit: float = 0.0
    k_position: float = 0.0
    k_velocity: float = 0.0


@dataclass(frozen=True, slots=True)
class ReferencePositions:
    """Where a joint's reference switch changes; URDF calls it calibration."""

    rising: float | None = None
    falling: float | None = None


@dataclass(frozen=True, slots=True)
class Joint:
    """A joint that can move; ``axis`` is a unit vector in the child's frame, for planar the plane's normal."""

    name: str
    type: JointType
    at: Span
    axis: Vector = (1.0, 0.0, 0.0)
    limit: Limit | None = None
    mimic: str | None = None
    multiplier: float = 1.0
    offset: float = 0.0
    axis_length: float = 1.0  # as it was written
    dynamics: Dynamics | None = None
    safety: SafetyController | None = None
    reference: ReferencePositions | None = None
