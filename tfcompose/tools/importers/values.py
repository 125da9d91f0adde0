"""Bodies, joints and poses of a robot as plain data for a robot file.

The data do not contain default values. An angle is in degrees if this is exact, else in radians
with all digits.
"""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from tfcompose.compiler.urdf.schema import MOMENTS
from tfcompose.foundation.geometry import Pose, angle_between, quat_from_rpy
from tfcompose.foundation.numbers import clean_rpy, number
from tfcompose.model.robot import BOUNDED, materials

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from tfcompose.foundation.geometry import Quaternion, Vector
    from tfcompose.model.files import Target
    from tfcompose.model.robot import Edge, Inertial, Joint, Link, Material, Robot, Shape

#: The largest difference (rad) at which an angle is written as a number of degrees with few
#: decimals.
_MEANT_RAD = 5e-13
_DECIMALS = 4
#: The largest difference (rad) at which a rotation is written with the source's angles. A
#: quaternion keeps half of an angle's error.
_SAME_RAD = 1e-12

_SOFT_LIMITS = ("soft_lower_limit", "soft_upper_limit")
#: URDF's default axis of a joint.
_X = (1.0, 0.0, 0.0)
_DIAGONAL = ("ixx", "iyy", "izz")


class RobotFileValues:
    """Converts parts of a robot to plain data.

    A colour is described at its first use; later uses contain only its name. ``rpy`` contains the
    source's angles, by rotation. ``target`` is the robot file, from which relative paths start.
    """

    def __init__(self, rpy: Mapping[Quaternion, Vector], robot: Robot, target: Target) -> None:
        self.rpy, self.target = rpy, target
        self.described: set[str] = set()
        self.clashing = _clashing(robot)

    def pose(self, pose: Pose) -> dict[str, Any]:
        """Return the keys of a pose."""
        rpy = rotation(pose.quat_xyzw, self.rpy.get(pose.quat_xyzw))
        return ({"xyz": list(pose.xyz)} if any(pose.xyz) else {}) | ({"rpy": rpy} if rpy else {})

    def link(self, link: Link) -> dict[str, Any]:
        """Return the keys of a link's body."""
        visuals = [self.shape(shape) for shape in link.visuals]
        collisions = [self.shape(shape, plain=True) for shape in link.collisions]
        body: dict[str, Any] = (
            {"visual": visuals[0] if len(visuals) == 1 else visuals} if visuals else {}
        )
        if collisions and collisions == [self.shape(shape, plain=True) for shape in link.visuals]:
            body["collision"] = "same"
        elif collisions:
            body["collision"] = collisions[0] if len(collisions) == 1 else collisions
        return body | ({"inertial": self.inertial(link.inertial)} if link.inertial else {})

    def shape(self, shape: Shape, *, plain: bool = False) -> dict[str, Any]:
        """Return the keys of a shape; if ``plain``, without its colour."""
        values = self.pose(shape.pose) | {shape.kind: self.size(shape)}
        return (
            values
            if plain or shape.material is None
            else values | {"material": self.material(shape.material)}
        )

    def material(self, material: Material) -> dict[str, Any]:
        """Return the keys of a material: colour or texture, and name."""
        values: dict[str, Any] = {"name": material.name}
        if material.name in self.described and material.name not in self.clashing:
            return values
        self.described.add(material.name)
        values |= {"rgba": list(material.rgba)} if material.rgba else {}
        return values | (
            {"texture": self.target.address(material.texture)} if material.texture else {}
        )

    def size(self, shape: Shape) -> Any:
        """Return the value of a shape's key: its size, or its file."""
        if shape.kind == "box":
            return list(shape.size)
        if shape.mesh is None:
            return dict(zip(("radius", "length"), shape.size, strict=False))
        uri, (x, y, z) = self.target.address(shape.mesh), shape.size
        return (
            uri
            if (x, y, z) == (1, 1, 1)
            else {"uri": uri, "scale": x if x == y == z else [x, y, z]}
        )

    def inertial(self, inertial: Inertial) -> dict[str, Any]:
        """Return the keys of mass and inertia."""
        tensor = dict(zip(MOMENTS, inertial.tensor, strict=True))
        moments = {key: tensor[key] for key in _DIAGONAL} | {
            key: value for key, value in tensor.items() if value
        }
        return self.pose(inertial.pose) | {"mass": inertial.mass, "inertia": moments}

    def joint(self, edge: Edge, owner: str | None) -> dict[str, Any]:
        """Return the keys of a joint and its edge."""
        joint = edge.joint or edge.free
        values: dict[str, Any] = {
            "type": joint.type if joint else "fixed",
            "parent": edge.parent,
            "child": edge.child,
        }
        values |= self.pose(edge.pose) | ({"owner": owner} if owner else {})
        if joint is None:
            return values
        if joint.axis != _X or (joint.axis_at and joint.type != "floating"):
            values["axis"] = _axis(joint)
        return values | _motion(joint)


def angle(value: float) -> str | float:
    """Return the angle (rad) in the form of a robot file: ``-90 deg``, or radians."""
    degrees = round(math.degrees(value), _DECIMALS) + 0.0
    if abs(math.radians(degrees) - value) > _MEANT_RAD:
        return value
    return f"{number(degrees)} deg" if degrees else 0.0


def rotation(quat_xyzw: Quaternion, source_rpy: Vector | None = None) -> list[str | float] | None:
    """Return roll, pitch and yaw in the form of a robot file, or None for no rotation."""
    if quat_xyzw == Pose().quat_xyzw:
        return None
    rpy = source_rpy or clean_rpy(quat_xyzw)
    angles = [angle(value) for value in rpy]
    roll, pitch, yaw = map(_radians, angles)
    if angle_between(quat_from_rpy(roll, pitch, yaw), quat_xyzw) > _SAME_RAD:
        return list(rpy)
    return angles if any(angles) else None


def _radians(value: str | float) -> float:
    return math.radians(float(value.removesuffix(" deg"))) if isinstance(value, str) else value


def _clashing(robot: Robot) -> frozenset[str]:
    """Return the names that materials with different colours share."""
    values: dict[str, set[Any]] = {}
    for material in materials(robot.links):
        values.setdefault(material.name, set()).add((material.rgba, material.texture))
    return frozenset(name for name, kinds in values.items() if len(kinds) > 1)


def _axis(joint: Joint) -> list[float]:
    """Return the joint's axis.

    If its length in the source is nearly 1, return the source's numbers, which have fewer digits.
    """
    if not 0.98 < joint.axis_length < 1.02:  # noqa: PLR2004 (another length is a finding of its own)
        return list(joint.axis)
    return [float(f"{part * joint.axis_length:.15g}") for part in joint.axis]


def _motion(joint: Joint) -> dict[str, Any]:
    position: Callable[[float], Any] = angle if joint.type in {"revolute", "continuous"} else float
    values: dict[str, Any] = {}
    limit, reference = joint.limit, joint.reference
    if limit:
        ends = {"lower": limit.lower, "upper": limit.upper}
        if joint.type in BOUNDED:  # URDF's default for a missing limit of these joints is 0
            ends = {key: value or 0.0 for key, value in ends.items()}
        limits = {key: position(value) for key, value in ends.items() if value is not None}
        rates = {"effort": limit.effort, "velocity": limit.velocity}
        values["limit"] = limits | {
            key: value for key, value in rates.items() if value is not None
        }
    if joint.mimic is not None:
        values["mimic"] = {"joint": joint.mimic} | (
            {"multiplier": joint.multiplier} if joint.multiplier != 1 else {}
        )
        values["mimic"] |= {"offset": position(joint.offset)} if joint.offset else {}
    if joint.dynamics:
        values["dynamics"] = asdict(joint.dynamics)
    if joint.safety:
        safety = asdict(joint.safety)
        safety |= {key: position(safety[key]) for key in safety.keys() & _SOFT_LIMITS}
        values["safety_controller"] = safety
    if reference:
        ends = {"rising": reference.rising, "falling": reference.falling}
        values["calibration"] = {
            key: position(value) for key, value in ends.items() if value is not None
        }
    return values
