"""A link's part of the URDF: masses, shapes, colours.

URDF has no capsule in the versions that ROS 2 Jazzy reads, and a reader refuses the whole robot for one: it is written
as the cylinder and the two spheres that together are the same solid.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.emit.markup import quoted
from tfcompose.geometry import Pose
from tfcompose.numbers import clean_rpy, clean_tensor, clean_xyz, number, numbers

if TYPE_CHECKING:
    from tfcompose.files import Target
    from tfcompose.model import Inertial, Link, Material, Shape


def link_lines(name: str, link: Link | None, target: Target) -> list[str]:
    """Return the link's element, line by line; ``target`` says how files are addressed."""
    body: list[str] = []
    if link and link.inertial:
        body += _inertial(link.inertial)
    for shape in link.visuals if link else ():
        body += _shape("visual", shape, target)
    for shape in link.collisions if link else ():
        body += _shape("collision", shape, target)
    if not body:
        return [f"  <link name={quoted(name)}/>"]
    return [f"  <link name={quoted(name)}>", *body, "  </link>"]


def _inertial(inertial: Inertial) -> list[str]:
    named = zip(("ixx", "ixy", "ixz", "iyy", "iyz", "izz"), clean_tensor(inertial.tensor), strict=True)
    tensor = " ".join(f'{name}="{number(value)}"' for name, value in named)
    return [
        "    <inertial>",
        *origin(inertial.pose, "      "),
        f'      <mass value="{number(inertial.mass)}"/>',
        f"      <inertia {tensor}/>",
        "    </inertial>",
    ]


def _shape(tag: str, shape: Shape, target: Target) -> list[str]:
    material = _material(shape.material, target) if shape.material and tag == "visual" else []
    lines = []
    for geometry, pose in _geometries(shape, target):
        at = origin(pose, "      ")
        lines += [f"    <{tag}>", *at, f"      <geometry>{geometry}</geometry>", *material, f"    </{tag}>"]
    return lines


def _geometries(shape: Shape, target: Target) -> list[tuple[str, Pose]]:
    if shape.kind == "box":
        return [(f'<box size="{numbers(shape.size)}"/>', shape.pose)]
    if shape.mesh is not None:
        scale = "" if shape.size == (1.0, 1.0, 1.0) else f' scale="{numbers(shape.size)}"'
        return [(f"<mesh filename={quoted(target.address(shape.mesh))}{scale}/>", shape.pose)]
    radius = f'radius="{number(shape.size[0])}"'
    if shape.kind == "sphere":
        return [(f"<sphere {radius}/>", shape.pose)]
    cylinder = (f'<cylinder {radius} length="{number(shape.size[1])}"/>', shape.pose)
    if shape.kind == "cylinder":
        return [cylinder]
    ends = [Pose((0.0, 0.0, sign * shape.size[1] / 2)) for sign in (1, -1)]
    return [cylinder, *((f"<sphere {radius}/>", shape.pose @ end) for end in ends)]


def _material(material: Material, target: Target) -> list[str]:
    inside = "" if material.rgba is None else f'<color rgba="{numbers(material.rgba)}"/>'
    if material.texture is not None:
        inside += f"<texture filename={quoted(target.address(material.texture))}/>"
    return [f"      <material name={quoted(material.name)}>{inside}</material>"]


def origin(pose: Pose, indent: str) -> list[str]:
    """Return the element that says where something is, or none where it is at home."""
    if pose == _AT_HOME:
        return []
    return [f'{indent}<origin xyz="{numbers(clean_xyz(pose.xyz))}" rpy="{numbers(clean_rpy(pose.quat_xyzw))}"/>']


_AT_HOME = Pose()
