"""Changes of a pose as people type them: ``+2mm`` along x, ``-0.5deg`` of yaw, ``=0.3m`` for z."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from tfcompose.foundation.geometry import Pose, multiply, quat_from_rpy
from tfcompose.foundation.units import (
    ANGLE,
    LARGEST,
    LENGTH,
    NUMBER,
    UnitError,
    dimension_name,
    example,
    quantity,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

#: The values of a pose, in the order of xyz and rpy.
AXES = ("x", "y", "z", "roll", "pitch", "yaw")
#: The angles among them.
ANGLES = frozenset({"roll", "pitch", "yaw"})
_SIGNS = "+-−"


class ChangeError(ValueError):
    """A text is no change; the message says why, and what to write."""


@dataclass(frozen=True, slots=True)
class PoseChange:
    """A change of one value of a pose."""

    axis: str
    #: In metres, or radians.
    value: float
    #: Whether ``value`` is added to the current one, instead of replacing it.
    relative: bool = True


def change_of(axis: str, text: str) -> PoseChange:
    """Return the change that a text means: ``+2mm`` and ``-2mm`` add, ``=2mm`` replaces.

    Raises:
        ChangeError: if it is neither, has no unit, or is too large.
    """
    dimension = ANGLE if axis in ANGLES else LENGTH
    sign, number = text.strip()[:1], text.strip().removeprefix("=")
    if not sign or sign not in f"{_SIGNS}=":
        raise ChangeError(
            f"--{axis} {text} is neither a change nor a value; write +{text} to add to the"
            f" current one, ={text} to replace it"
        )
    try:
        value = quantity(number.replace("−", "-"), dimension)
    except UnitError as error:
        advice = f"; {error.advice}" if error.advice else ""
        raise ChangeError(f"--{axis} {text}: {error}{advice}") from None
    if value.dimension == NUMBER and value.value:
        raise ChangeError(f"--{axis} {text} has no unit; write {sign}{example(dimension)}")
    if value.dimension not in {NUMBER, dimension}:
        required = f"{dimension_name(dimension)}, not {dimension_name(value.dimension)}"
        raise ChangeError(
            f"--{axis} {text}: give the {required}; write {sign}{example(dimension)}"
        )
    if abs(value.value) > LARGEST:
        raise ChangeError(f"--{axis} {text} is too large to compute with")
    return PoseChange(axis, value.value, relative=sign != "=")


def change_pose(pose: Pose, changes: Sequence[PoseChange], *, local: bool) -> Pose:
    """Return a pose after the changes: first those that replace values, then those that add.

    Positions add along the parent's axes, and rotations about them, at the mount's origin: roll,
    then pitch, then yaw. With ``local`` the axes are the mount's own.

    Raises:
        ChangeError: if a file could not have the new position.
    """
    values = dict(zip(AXES, (*pose.xyz, *pose.rpy), strict=True))
    replaced = {change.axis: change.value for change in changes if not change.relative}
    if replaced:
        x, y, z, roll, pitch, yaw = (values | replaced).values()
        # Unchanged angles are kept to the last bit.
        quat = quat_from_rpy(roll, pitch, yaw) if replaced.keys() & ANGLES else pose.quat_xyzw
        pose = Pose((x, y, z), quat)
    added = {change.axis: change.value for change in changes if change.relative}
    x, y, z, roll, pitch, yaw = (added.get(axis, 0.0) for axis in AXES)
    rotation = quat_from_rpy(roll, pitch, yaw)
    if local:
        new = pose @ Pose((x, y, z), rotation)
    else:
        moved = (pose.xyz[0] + x, pose.xyz[1] + y, pose.xyz[2] + z)
        new = Pose(moved, multiply(rotation, pose.quat_xyzw))
    if max(map(abs, new.xyz)) > LARGEST:
        raise ChangeError("the new position is too large to compute with")
    return new
