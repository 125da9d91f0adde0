"""Comparison of a written URDF with its robot, value by value.

yourdfpy reads the links and joints of the URDF. The comparison cannot detect some errors, because
yourdfpy ignores other elements (``ros2_control``, ``gazebo``, ``transmission``), uses only the
first of duplicate elements, and fills in URDF's defaults for missing elements and attributes.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from dataclasses import fields
from io import BytesIO
from itertools import chain
from typing import TYPE_CHECKING, Any

import yourdfpy

from tfcompose.compiler.urdf.write import joint_type
from tfcompose.foundation.geometry import Pose, angle_between, matrix_from_quat
from tfcompose.model.robot import JOINTS, STATIC

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model.files import Target
    from tfcompose.model.robot import Edge, Inertial, Joint, Link, Material, Robot, Shape

#: Tolerances. Positions are written to a picometre. Angles and matrix entries have rounding errors
#: of this size.
FAR_M = FAR_RAD = 1e-11
#: Relative tolerance of moments, which are written with 12 digits.
FAR_MOMENT = 1e-11
#: Indices of the moments (xx, xy, xz, yy, yz, zz) in the tensor.
_MOMENTS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))


def differences(robot: Robot, text: str, target: Target, *, full: bool) -> Iterator[str]:
    """Yield the differences between the text and the robot.

    The comparison covers links, joints, poses, masses and shapes. ``text`` is the result of
    ``urdf`` or ``emit`` for the same target. ``full`` selects the full URDF, not the one for a
    stock publisher.
    """
    try:
        ET.fromstring(text)  # noqa: S314 (our own text); yourdfpy would mend what is not XML, and go on
    except ET.ParseError as error:
        yield f"it is not XML: {error}"
        return
    try:
        loaded = yourdfpy.URDF.load(
            BytesIO(text.encode()), build_scene_graph=False, load_meshes=False
        ).robot
    except Exception as error:  # noqa: BLE001 (whatever yourdfpy stumbles over in a text that is no URDF)
        yield f"yourdfpy does not read it: {type(error).__name__}: {error}"
        return
    if loaded.name != robot.name:
        yield f"its name is {loaded.name}, not {robot.name}"
    base = robot.base or ""
    frames = robot.described_frames()
    links = {link.name: link for link in loaded.links}
    joints = {joint.child: joint for joint in loaded.joints}
    edges = {
        edge.child: edge for edge in robot.edges if edge.child in frames and edge.child != base
    }
    for about, read, listed, expected in (
        ("links", links.keys(), loaded.links, frames),
        ("joints to these links", joints.keys(), loaded.joints, edges.keys()),
    ):
        wrong = sorted(read ^ expected)
        if wrong or len(listed) != len(expected):
            yield f"{about} are missing, new or there twice: {', '.join(wrong)}"
            return
    for child, edge in edges.items():
        mine = full or edge.owner in {STATIC, JOINTS}
        joint = joints[child]
        kind = joint_type(edge) if mine else "floating"
        yield from (
            f"the joint {joint.name}: {difference}" for difference in _of_joint(joint, edge, kind)
        )
    for name in frames:
        link = robot.links.get(name)
        body = None if link is None or (name == base and not full) else link.inertial
        yield from (
            f"the link {name}: {difference}"
            for difference in _of_link(links[name], link, body, target)
        )


def _is_moved(origin: Any, pose: Pose) -> bool:
    """Return whether yourdfpy's 4×4 matrix, None for no origin, differs from the pose."""
    if origin is None:
        return (
            math.hypot(*pose.xyz) > FAR_M
            or angle_between(pose.quat_xyzw, Pose().quat_xyzw) > FAR_RAD
        )
    (a, b, c, x), (d, e, f, y), (g, h, i, z), _ = origin.tolist()
    expected = chain(*matrix_from_quat(pose.quat_xyzw))
    far = (
        abs(element - expected_element)
        for element, expected_element in zip((a, b, c, d, e, f, g, h, i), expected, strict=True)
    )
    return math.dist((x, y, z), pose.xyz) > FAR_M or max(far) > FAR_RAD


def _of_joint(loaded: yourdfpy.Joint, edge: Edge, kind: str) -> Iterator[str]:
    if edge.joint_name and loaded.name != edge.joint_name:
        yield f"its name is not {edge.joint_name}"
    if loaded.type != kind:
        yield f"its type is {loaded.type}, not {kind}"
    if loaded.parent != edge.parent:
        yield f"its parent is {loaded.parent}, not {edge.parent}"
    if _is_moved(loaded.origin, edge.pose):
        yield "its origin differs"
    joint = edge.joint or edge.free
    if joint is None or kind != joint.type or kind == "floating":
        return
    axis = tuple(loaded.axis.tolist())
    if axis != joint.axis:
        yield f"axis is {axis}, not {joint.axis}"
    for tag, expected in _values(joint).items():
        value = getattr(loaded, tag)
        actual = None if value is None else _set_values(value)
        if (actual is None) != (expected is None):
            yield f"{tag} is {'missing' if actual is None else 'new'}"
        elif actual != expected:
            yield f"{tag} is {actual}, not {expected}"


def _set_values(values: Any) -> dict[str, Any]:
    """Return the fields of a dataclass. yourdfpy leaves the values of ``dynamics`` as text."""
    present = {}
    for field in fields(values):
        value = getattr(values, field.name)
        if value is not None:
            present[field.name] = value if field.name == "joint" else float(value)
    return present


def _values(joint: Joint) -> dict[str, dict[str, Any] | None]:
    """Return the expected values in the joint, by yourdfpy's names.

    None for an element that the joint must not have.
    """
    limit, mimic = joint.limit, joint.mimic
    rates = {
        "effort": (limit and limit.effort) or 0.0,
        "velocity": (limit and limit.velocity) or 0.0,
    }
    is_limited = limit is not None or joint.type in {"revolute", "prismatic"}
    return {
        "limit": (_set_values(limit) if limit else {}) | rates if is_limited else None,
        "dynamics": _set_values(joint.dynamics) if joint.dynamics else None,
        "safety_controller": _set_values(joint.safety) if joint.safety else None,
        "calibration": _set_values(joint.reference) if joint.reference else None,
        "mimic": (
            {"joint": mimic, "multiplier": joint.multiplier, "offset": joint.offset}
            if mimic
            else None
        ),
    }


def _of_link(
    loaded: yourdfpy.Link, link: Link | None, body: Inertial | None, target: Target
) -> Iterator[str]:
    if (loaded.inertial is None) != (body is None):
        yield f"its mass is {'missing' if loaded.inertial is None else 'new'}"
    elif body is not None and _is_another_body(loaded.inertial, body):
        yield "its mass differs"
    visuals, collisions = (link.visuals, link.collisions) if link else ((), ())
    for tag, read, shapes in (
        ("visual", loaded.visuals, visuals),
        ("collision", loaded.collisions, collisions),
    ):
        expected = [(shape, solid) for shape in shapes for solid in _solids(shape, target)]
        if len(read) != len(expected):
            yield f"it has {len(read)} {tag} elements, not {len(expected)}"
            continue
        for element, (shape, (kind, values, pose)) in zip(read, expected, strict=True):
            if _form(getattr(element.geometry, kind)) != values or _is_moved(element.origin, pose):
                yield f"a {kind} of its {tag} differs"
            if tag == "visual" and _paint(element.material) != _expected_paint(
                shape.material, target
            ):
                yield f"the material of a {kind} differs"


def _is_another_body(loaded: yourdfpy.Inertial, body: Inertial) -> bool:
    if loaded.mass is None or loaded.inertia is None:
        return True
    rows = loaded.inertia.tolist()
    off = max(abs(rows[i][j] - value) for (i, j), value in zip(_MOMENTS, body.tensor, strict=True))
    is_other_tensor = off > FAR_MOMENT * max(map(abs, body.tensor))
    return loaded.mass != body.mass or is_other_tensor or _is_moved(loaded.origin, body.pose)


def _paint(loaded: yourdfpy.Material | None) -> dict[str, Any]:
    if loaded is None:
        return {}
    colour = {} if loaded.color is None else {"rgba": tuple(loaded.color.rgba.tolist())}
    image = {} if loaded.texture is None else {"texture": loaded.texture.filename}
    return {"name": loaded.name} | colour | image


def _expected_paint(material: Material | None, target: Target) -> dict[str, Any]:
    if material is None:
        return {}
    colour = {"rgba": material.rgba} if material.rgba else {}
    image = {"texture": target.address(material.texture)} if material.texture else {}
    return {"name": material.name} | colour | image


def _form(solid: Any) -> dict[str, Any]:
    """Return the values of a solid; empty without a solid of this kind."""
    if solid is None:
        return {}
    values = {}
    for key, value in vars(solid).items():
        if value is not None:
            values[key] = tuple(value.tolist()) if hasattr(value, "tolist") else value
    return values


def _solids(shape: Shape, target: Target) -> Iterator[tuple[str, dict[str, Any], Pose]]:
    """Yield kind, values and pose of each solid that represents the shape in URDF.

    A capsule consists of several solids, because URDF has no capsule.
    """
    size, radius = shape.size, {"radius": shape.size[0]}
    if shape.mesh:
        scale = {} if size == (1.0, 1.0, 1.0) else {"scale": size}
        yield "mesh", {"filename": target.address(shape.mesh), **scale}, shape.pose
    elif shape.kind in {"box", "sphere"}:
        yield shape.kind, {"size": size} if shape.kind == "box" else radius, shape.pose
    else:
        yield "cylinder", {**radius, "length": size[1]}, shape.pose
        for end in (size[1] / 2, -size[1] / 2) if shape.kind == "capsule" else ():
            yield "sphere", radius, shape.pose @ Pose((0.0, 0.0, end))
