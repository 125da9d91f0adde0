"""Joints in the language: edges between bodies, in URDF's words."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.validate.edges import PARENT, EdgeKeys
from tfcompose.validate.fields import (
    AXIS,
    JOINT_DAMPING,
    JOINT_EFFORT,
    JOINT_SPEED,
    NUMBER_,
    POSITION,
    TEXT,
    choice,
)
from tfcompose.validate.schema import Model, key, record

if TYPE_CHECKING:
    from tfcompose.geometry import Vector


class Limit(Model):
    """What a joint can do; radians, or metres for a prismatic joint."""

    lower: float | None = key(POSITION, None)
    upper: float | None = key(POSITION, None)
    effort: float | None = key(JOINT_EFFORT, None, "N m, or N")
    velocity: float | None = key(JOINT_SPEED, None, "rad/s, or m/s")


class Mimic(Model):
    """The joint follows another one: multiplier · q + offset."""

    joint: str = key(TEXT)
    multiplier: float = key(NUMBER_, 1.0)
    offset: float = key(POSITION, 0.0)


class Dynamics(Model):
    """What slows the joint down."""

    damping: float = key(JOINT_DAMPING, 0.0, "N m s/rad, or N s/m")
    friction: float = key(JOINT_EFFORT, 0.0, "N m, or N")


class SafetyController(Model):
    """Where a controller begins to hold the joint back, before its limits."""

    soft_lower_limit: float = key(POSITION, 0.0)
    soft_upper_limit: float = key(POSITION, 0.0)
    k_position: float = key(NUMBER_, 0.0, "how hard it is held inside the soft limits")
    k_velocity: float = key(NUMBER_, about="how hard its speed is held inside the limit", examples=(10,))


class ReferencePositions(Model):
    """Where the joint's reference switch changes."""

    rising: float | None = key(POSITION, None)
    falling: float | None = key(POSITION, None)


class JointSpec(EdgeKeys):
    """An edge between bodies, in URDF's words. A planar or floating joint needs an owner: joint states say nothing."""

    type: str = key(choice("fixed", "revolute", "continuous", "prismatic", "planar", "floating"))
    parent: tuple[str, ...] = key(PARENT, about="the link that this joint hangs on")
    child: str = key(TEXT, about="the link that moves")
    axis: Vector = key(
        AXIS, (1.0, 0.0, 0.0), "in the child's frame; as in URDF the default is x; of planar: the normal", ([0, 0, 1],)
    )
    limit: Limit | None = key(record(Limit), None)
    mimic: Mimic | None = key(record(Mimic), None)
    dynamics: Dynamics | None = key(record(Dynamics), None, "damping and friction")
    safety_controller: SafetyController | None = key(record(SafetyController), None)
    calibration: ReferencePositions | None = key(
        record(ReferencePositions), None, "the reference switch, as in URDF; the pose of a joint is not measured here"
    )
