"""Whether a written URDF reads back as the robot that was meant: read with another parser, value by value."""

from __future__ import annotations

import math
import posixpath
import xml.etree.ElementTree as ET
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from tfcompose.emit.emit import described
from tfcompose.geometry import Pose, angle_between, quat_from_rpy
from tfcompose.model import JOINTS, STATIC
from tfcompose.plan import DESCRIPTION
from tfcompose.urdf.write import joint_type

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from tfcompose.files import File, Target
    from tfcompose.model import Edge, Inertial, Joint, Link, Material, Robot, Shape

#: Poses are written to a picometre, and angles to the noise of computing them.
FAR_M = FAR_RAD = 1e-11
#: Moments are written with 12 digits.
FAR_MOMENT = 1e-11
_MOMENTS = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")


def unlike(robot: Robot, files: Iterable[File], target: Target) -> list[tuple[str, str]]:
    """Return what the descriptions among the robot's files say otherwise than it: the file's path, and what.

    ``target`` is what they were written for.
    """
    texts = {file.path: file.text for file in files}
    found = []
    for part, described_robot in described(robot):
        folder = f"{part}/" if part else ""
        inside = replace(target, folder=posixpath.join(target.folder, folder))
        for name, full in ((DESCRIPTION, True), ("robot.urdf", False)):
            several = differences(described_robot, texts[folder + name], inside, full=full)
            found += [(folder + name, one) for one in several]
    return found


def differences(robot: Robot, text: str, target: Target, *, full: bool) -> Iterator[str]:
    """Yield what the text says otherwise than the robot: about links, joints, poses, masses and shapes.

    ``full`` is as in ``urdf``; the text is what that, or ``emit``, returned for the same target.
    """
    try:
        root = ET.fromstring(text)  # noqa: S314 (our own text)
    except ET.ParseError as error:
        yield f"it is not XML: {error}"
        return
    base = robot.base or ""
    frames = robot.below(base)
    links = {str(one.get("name")): one for one in root.iterfind("link")}
    joints = {str(_end(one, "child")): one for one in root.iterfind("joint")}
    edges = {edge.child: edge for edge in robot.edges if edge.child in frames and edge.child != base}
    for tag, there, meant in (("link", links.keys(), frames), ("joint", joints.keys(), edges.keys())):
        wrong = sorted(there ^ meant)
        if wrong or len(root.findall(tag)) != len(meant):
            about = "links" if tag == "link" else "joints to these links"
            yield f"{about} are missing, new or there twice: {', '.join(wrong)}"
            return
    for child, edge in edges.items():
        mine = full or edge.owner in {STATIC, JOINTS}
        said = f"the joint {joints[child].get('name')}"
        yield from (f"{said}: {one}" for one in _joint(joints[child], edge, joint_type(edge) if mine else "floating"))
    for name in frames:
        link = robot.links.get(name)
        body = None if link is None or (name == base and not full) else link.inertial
        yield from (f"the link {name}: {one}" for one in _link(links[name], link, body, target))


def _end(joint: Any, tag: str) -> str | None:
    end = joint.find(tag)
    return None if end is None else end.get("link")


@lru_cache(maxsize=1 << 16)
def _numbers(text: str) -> tuple[float, ...]:
    return tuple(map(float, text.split()))


@lru_cache(maxsize=1 << 16)
def _pose(xyz: str, rpy: str) -> Pose:
    x, y, z = _numbers(xyz)
    return Pose((x, y, z), quat_from_rpy(*_numbers(rpy)))


def _differs(element: Any, pose: Pose) -> bool:
    """Whether the element's origin is another one."""
    origin = element.find("origin")
    there = _HOME if origin is None else _pose(origin.get("xyz"), origin.get("rpy"))
    far = math.dist(there.xyz, pose.xyz) > FAR_M
    return far or (there.quat_xyzw != pose.quat_xyzw and angle_between(there.quat_xyzw, pose.quat_xyzw) > FAR_RAD)


_HOME = Pose()


def _joint(there: Any, edge: Edge, kind: str) -> Iterator[str]:
    if there.get("type") != kind:
        yield f"its type is {there.get('type')}, not {kind}"
    if _end(there, "parent") != edge.parent:
        yield f"its parent is {_end(there, 'parent')}, not {edge.parent}"
    if _differs(there, edge.pose):
        yield "its origin is another one"
    joint = edge.joint or edge.free
    for tag, meant in _motion(joint) if joint and kind == joint.type and kind != "floating" else ():
        found = there.find(tag)
        if (found is None) != (meant is None):
            yield f"{tag} is {'missing' if found is None else 'new'}"
        elif meant is not None and _values(found) != meant:
            yield f"{tag} is {_values(found)}, not {meant}"


def _values(element: Any) -> dict[str, Any]:
    return {key: value if key == "joint" else _numbers(value) for key, value in element.attrib.items()}


def _motion(joint: Joint) -> Iterator[tuple[str, dict[str, Any] | None]]:
    """Yield what is to stand in the joint, each as the element's values, or None where it is not to be there."""
    limit = joint.limit
    yield "axis", {"xyz": joint.axis}
    if limit or joint.type in {"revolute", "prismatic"}:
        ends = {"lower": limit.lower, "upper": limit.upper} if limit else {}
        rates = {"effort": limit.effort or 0.0, "velocity": limit.velocity or 0.0} if limit else _NO_RATES
        yield "limit", {key: (value,) for key, value in (ends | rates).items() if value is not None}
    else:
        yield "limit", None
    named = (("dynamics", joint.dynamics), ("safety_controller", joint.safety), ("calibration", joint.reference))
    for tag, said in named:
        values = {key: getattr(said, key) for key in said.__slots__} if said else {}
        yield tag, {key: (value,) for key, value in values.items() if value is not None} if said else None
    mimic = {"joint": joint.mimic, "multiplier": (joint.multiplier,), "offset": (joint.offset,)}
    yield "mimic", mimic if joint.mimic is not None else None


_NO_RATES = {"effort": 0.0, "velocity": 0.0}


def _link(there: Any, link: Link | None, body: Inertial | None, target: Target) -> Iterator[str]:
    inertial = there.find("inertial")
    if (inertial is None) != (body is None):
        yield f"its mass is {'missing' if inertial is None else 'new'}"
    elif body is not None and _is_another(inertial, body):
        yield "its mass is another one"
    for tag, shapes in (("visual", link.visuals), ("collision", link.collisions)) if link else ():
        found = there.findall(tag)
        meant = [(shape, solid) for shape in shapes for solid in _solids(shape, target)]
        if len(found) != len(meant):
            yield f"it has {len(found)} {tag} elements, not {len(meant)}"
            continue
        for one, (shape, (kind, values, pose)) in zip(found, meant, strict=True):
            form = one.find(f"geometry/{kind}")
            if form is None or _form(form) != values or _differs(one, pose):
                yield f"a {kind} of its {tag} is another one"
            if tag == "visual" and _paint(one.find("material")) != _meant_paint(shape.material, target):
                yield f"the material of a {kind} is another one"


def _is_another(there: Any, body: Inertial) -> bool:
    tensor = there.find("inertia").attrib
    off = (abs(float(tensor[key]) - value) for key, value in zip(_MOMENTS, body.tensor, strict=True))
    most = FAR_MOMENT * max(map(abs, body.tensor))
    return float(there.find("mass").get("value")) != body.mass or max(off) > most or _differs(there, body.pose)


def _paint(there: Any) -> dict[str, Any]:
    if there is None:
        return {}
    return {"name": there.get("name")} | {one.tag: _form(one) for one in there}


def _meant_paint(material: Material | None, target: Target) -> dict[str, Any]:
    if material is None:
        return {}
    colour = {"color": {"rgba": material.rgba}} if material.rgba else {}
    image = {"texture": {"filename": target.address(material.texture)}} if material.texture else {}
    return {"name": material.name} | colour | image


def _form(form: Any) -> dict[str, Any]:
    return {key: value if key == "filename" else _numbers(value) for key, value in form.attrib.items()}


def _solids(shape: Shape, target: Target) -> Iterator[tuple[str, dict[str, Any], Pose]]:
    """Yield the solids that a shape is in URDF, which has no capsule: kind, attributes and pose of each."""
    size, radius = shape.size, {"radius": shape.size[:1]}
    if shape.mesh:
        scale = {} if size == (1.0, 1.0, 1.0) else {"scale": size}
        yield "mesh", {"filename": target.address(shape.mesh), **scale}, shape.pose
    elif shape.kind in {"box", "sphere"}:
        yield shape.kind, {"size": size} if shape.kind == "box" else radius, shape.pose
    else:
        yield "cylinder", {**radius, "length": size[1:]}, shape.pose
        for end in (size[1] / 2, -size[1] / 2) if shape.kind == "capsule" else ():
            yield "sphere", radius, shape.pose @ Pose((0.0, 0.0, end))
