"""Bodies, joints and poses in the words of the robot file, as plain data; what is the default is left out."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tfcompose.emit.angles import angle, turn
from tfcompose.model import Dynamics, SafetyController

if TYPE_CHECKING:
    from collections.abc import Callable

    from tfcompose.files import Target
    from tfcompose.geometry import Pose, Quaternion, Vector
    from tfcompose.model import Edge, Inertial, Joint, Link, Material, Robot, Shape

_TENSOR = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
_SOFT_LIMITS = ("soft_lower_limit", "soft_upper_limit")
_ORDER = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")


class Said:
    """Says one robot; a colour that has been said once is later its name alone."""

    def __init__(self, rpy: dict[Quaternion, Vector], robot: Robot, target: Target) -> None:
        self.rpy, self.target = rpy, target
        self.first: dict[str, Material] = {}
        self.clashing = _clashing(robot)

    def pose(self, pose: Pose) -> dict[str, Any]:
        """Return the keys of a pose."""
        turned = turn(pose.quat_xyzw, self.rpy.get(pose.quat_xyzw))
        said: dict[str, Any] = {"xyz": list(pose.xyz)} if any(pose.xyz) else {}
        return said | ({"rpy": turned} if turned else {})

    def link(self, link: Link) -> dict[str, Any]:
        """Return the body."""
        visuals = [self.shape(shape) for shape in link.visuals]
        collisions = [self.shape(shape, plain=True) for shape in link.collisions]
        said: dict[str, Any] = {"visual": visuals[0] if len(visuals) == 1 else visuals} if visuals else {}
        if collisions and collisions == [self.shape(shape, plain=True) for shape in link.visuals]:
            said["collision"] = "same"
        elif collisions:
            said["collision"] = collisions[0] if len(collisions) == 1 else collisions
        return said | ({"inertial": self.inertial(link.inertial)} if link.inertial else {})

    def shape(self, shape: Shape, *, plain: bool = False) -> dict[str, Any]:
        """Return the shape; ``plain``, without its colour."""
        said: dict[str, Any] = self.pose(shape.pose) | {shape.kind: self.form(shape)}
        return said if plain or shape.material is None else said | {"material": self.material(shape.material)}

    def material(self, material: Material) -> dict[str, Any]:
        """Return the colour or texture, and its name."""
        before = self.first.get(material.name)
        if before and material.name not in self.clashing:
            return {"name": material.name}
        self.first.setdefault(material.name, material)
        said: dict[str, Any] = {"name": material.name}
        said |= {"rgba": list(material.rgba)} if material.rgba else {}
        return said | ({"texture": self.target.address(material.texture)} if material.texture else {})

    def form(self, shape: Shape) -> Any:
        """Return the shape's size, or its file."""
        if shape.kind == "box":
            return list(shape.size)
        if shape.mesh is None:
            return dict(zip(("radius", "length"), shape.size, strict=False))
        uri, (x, y, z) = self.target.address(shape.mesh), shape.size
        return uri if (x, y, z) == (1, 1, 1) else {"uri": uri, "scale": x if x == y == z else [x, y, z]}

    def inertial(self, inertial: Inertial) -> dict[str, Any]:
        """Return mass and tensor."""
        tensor = dict(zip(_TENSOR, inertial.tensor, strict=True))
        moments = {key: tensor[key] for key in _ORDER if tensor[key] or key in _ORDER[:3]}
        return self.pose(inertial.pose) | {"mass": inertial.mass, "inertia": moments}

    def joint(self, edge: Edge, owner: str | None) -> dict[str, Any]:
        """Return the joint with its edge."""
        joint = edge.joint or edge.free
        kind = joint.type if joint else "fixed"
        said = {"type": kind, "parent": edge.parent, "child": edge.child, **self.pose(edge.pose)}
        said |= {"owner": owner} if owner else {}
        if joint is None:
            return said
        return said | ({"axis": _axis(joint)} if joint.axis != (1.0, 0.0, 0.0) else {}) | _motion(joint)


def _clashing(robot: Robot) -> frozenset[str]:
    """Return the names under which the robot has different colours."""
    known: dict[str, set[Any]] = {}
    for link in robot.links.values():
        for shape in link.visuals:
            if shape.material:
                known.setdefault(shape.material.name, set()).add((shape.material.rgba, shape.material.texture))
    return frozenset(name for name, several in known.items() if len(several) > 1)


def _axis(joint: Joint) -> list[float]:
    """Return the axis at the length at which it was written, if that is nearly 1: its digits are fewer."""
    near = 0.98 < joint.axis_length < 1.02  # noqa: PLR2004 (of another length it is a finding, and nothing is lost)
    return [float(f"{part * joint.axis_length:.15g}") if near else part for part in joint.axis]


def _motion(joint: Joint) -> dict[str, Any]:
    place: Callable[[float], Any] = angle if joint.type in {"revolute", "continuous"} else float
    said: dict[str, Any] = {}
    limit, reference = joint.limit, joint.reference
    if limit:
        ends = {"lower": limit.lower, "upper": limit.upper}
        if joint.type in {"revolute", "prismatic"}:  # of these URDF takes 0 for an end that is left out
            ends = {key: value or 0.0 for key, value in ends.items()}
        limits = {key: place(value) for key, value in ends.items() if value is not None}
        rates = {"effort": limit.effort, "velocity": limit.velocity}
        said["limit"] = limits | {key: value for key, value in rates.items() if value is not None}
    if joint.mimic is not None:
        said["mimic"] = {"joint": joint.mimic} | ({"multiplier": joint.multiplier} if joint.multiplier != 1 else {})
        said["mimic"] |= {"offset": place(joint.offset)} if joint.offset else {}
    if joint.dynamics:
        said["dynamics"] = {key: getattr(joint.dynamics, key) for key in Dynamics.__slots__}
    if joint.safety:
        values = {key: getattr(joint.safety, key) for key in SafetyController.__slots__}
        said["safety_controller"] = {
            key: place(value) if key in _SOFT_LIMITS else value for key, value in values.items()
        }
    if reference:
        ends = {"rising": reference.rising, "falling": reference.falling}
        said["calibration"] = {key: place(value) for key, value in ends.items() if value is not None}
    return said
