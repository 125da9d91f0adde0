"""URDF of a robot: everything below its base.

Conventions follow the URDF XML specification. A joint's origin is the pose of its child link in
its parent link, rpy are fixed-axis angles, and an axis is in the joint's frame.
"""

from __future__ import annotations

import re
from dataclasses import fields, replace
from functools import lru_cache
from textwrap import dedent, indent
from typing import TYPE_CHECKING
from xml.sax.saxutils import escape, quoteattr

from tfcompose.compiler.urdf.blocks import ATTRIBUTES
from tfcompose.compiler.urdf.schema import MOMENTS
from tfcompose.foundation.geometry import Pose
from tfcompose.foundation.numbers import clean_rpy, clean_tensor, clean_xyz, number, numbers
from tfcompose.model.files import AS_IN_SOURCE
from tfcompose.model.robot import BOUNDED, JOINTS, STATIC

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from tfcompose.model.files import Target
    from tfcompose.model.robot import (
        Asset,
        Edge,
        Inertial,
        Joint,
        Link,
        Material,
        Robot,
        Shape,
    )
    from tfcompose.model.robot.hardware import Block, Hardware, HardwareComponent, Interface

_IDENTITY = Pose()
_ORIGIN_LINE = re.compile(r"\A    <origin [^\n]*/>\n")
#: The value of an attribute, in quotes. Names repeat, in one file and from file to file.
quoted = lru_cache(maxsize=1 << 16)(quoteattr)


def urdf(robot: Robot, target: Target = AS_IN_SOURCE) -> tuple[str, str]:
    """Return the URDF below ``robot.base``: the full URDF, and the URDF for a stock publisher.

    The base must exist and be in a valid tree. The full URDF describes every edge. In the URDF for
    a stock robot_state_publisher, edges of other owners are floating joints, which that node
    ignores. ``target`` holds the form of file addresses.
    """
    writer = UrdfWriter(target)
    head = ('<?xml version="1.0"?>', f"<robot name={quoted(robot.name)}>")
    tail = (*writer.hardware(robot), *block_lines(robot.blocks), "</robot>", "")
    full, stock = ("\n".join([*head, *lines, *tail]) for lines in writer.body(robot))
    return full, stock


def block_lines(blocks: Iterable[Block]) -> list[str]:
    """Return raw blocks verbatim, except for their indentation."""
    return [indent(dedent(block.text).strip("\n"), "  ") for block in blocks]


class UrdfWriter:
    """Writes links, joints and hardware as lines.

    Subclasses can change how names and values are written.
    """

    def __init__(self, target: Target = AS_IN_SOURCE) -> None:
        self.target = target

    def name(self, text: str) -> str:
        """Return the quoted name of a link, joint, material or hardware component."""
        return quoted(text)

    def value(self, text: str) -> str:
        """Return the quoted value of any other attribute."""
        return quoted(text)

    def content(self, text: str) -> str:
        """Return the content of an element."""
        return escape(text)

    def parameter(self, text: str) -> str:
        """Return the content of a hardware parameter."""
        return self.content(text)

    def address(self, asset: Asset) -> str:
        """Return the quoted address of a mesh or texture."""
        return quoted(self.target.address(asset))

    def body(self, robot: Robot) -> tuple[list[str], list[str]]:
        """Return the elements below ``robot.base``: the full URDF, and that for a stock publisher.

        A frame with an unknown pose is omitted together with the frames below it, and a comment
        reports this. For a stock publisher the root link has no inertia, because KDL, its URDF
        reader, ignores the inertia of a root link and warns at each start.

        Raises:
            ValueError: if the robot has no base.
        """
        if robot.base is None:
            raise ValueError(f"{robot.name} has no base")
        described = robot.described_frames()
        edges = [edge for edge in _below(robot.base, robot.children()) if edge.child in described]
        links = [
            line for edge in edges for line in self.link(edge.child, robot.links.get(edge.child))
        ]
        root = robot.links.get(robot.base)
        full = self.link(robot.base, root) + links
        stock = self.link(robot.base, root and replace(root, inertial=None)) + links
        for edge, name in zip(edges, _joint_names(edges), strict=True):
            joint = self.joint(edge, name, joint_type(edge))
            full += joint
            stock += (
                joint if edge.owner in {STATIC, JOINTS} else self.joint(edge, name, "floating")
            )
        left_out = [
            _unknown(edge)
            for edge in robot.edges
            if not edge.pose_known and edge.parent in described
        ]
        return full + left_out, stock + left_out

    def link(self, name: str, link: Link | None) -> list[str]:
        """Return the link with its mass, shapes and colours."""
        body: list[str] = []
        if link and link.inertial:
            body += _inertial(link.inertial)
        for shape in link.visuals if link else ():
            body += self._shape("visual", shape)
        for shape in link.collisions if link else ():
            body += self._shape("collision", shape)
        if not body:
            return [f"  <link name={self.name(name)}/>"]
        return [f"  <link name={self.name(name)}>", *body, "  </link>"]

    def _shape(self, tag: str, shape: Shape) -> list[str]:
        material = [self._material(shape.material)] if shape.material and tag == "visual" else []
        lines = []
        for geometry, pose in self._geometries(shape):
            path = _origin(pose, "      ")
            lines += [
                f"    <{tag}>",
                *path,
                f"      <geometry>{geometry}</geometry>",
                *material,
                f"    </{tag}>",
            ]
        return lines

    def _geometries(self, shape: Shape) -> list[tuple[str, Pose]]:
        """Return the solids of the shape, each with its pose.

        A capsule is written as a cylinder and two spheres, which together form the same solid. In
        ROS 2 Jazzy, URDF has no capsule, and a parser would reject the entire robot.
        """
        if shape.kind == "box":
            return [(f'<box size="{numbers(shape.size)}"/>', shape.pose)]
        if shape.mesh is not None:
            scale = "" if shape.size == (1.0, 1.0, 1.0) else f' scale="{numbers(shape.size)}"'
            return [(f"<mesh filename={self.address(shape.mesh)}{scale}/>", shape.pose)]
        radius = f'radius="{number(shape.size[0])}"'
        if shape.kind == "sphere":
            return [(f"<sphere {radius}/>", shape.pose)]
        cylinder = (f'<cylinder {radius} length="{number(shape.size[1])}"/>', shape.pose)
        if shape.kind == "cylinder":
            return [cylinder]
        ends = [Pose((0.0, 0.0, sign * shape.size[1] / 2)) for sign in (1, -1)]
        return [cylinder, *((f"<sphere {radius}/>", shape.pose @ end) for end in ends)]

    def _material(self, material: Material) -> str:
        inside = "" if material.rgba is None else f'<color rgba="{numbers(material.rgba)}"/>'
        if material.texture is not None:
            inside += f"<texture filename={self.address(material.texture)}/>"
        return f"      <material name={self.name(material.name)}>{inside}</material>"

    def joint(self, edge: Edge, name: str, kind: str) -> list[str]:
        """Return the lines of a joint of type ``kind`` for the edge."""
        lines = [
            f'  <joint name={self.name(name)} type="{kind}">',
            f"    <parent link={self.name(edge.parent)}/>",
            f"    <child link={self.name(edge.child)}/>",
            *_origin(edge.pose, "    "),
        ]
        joint = edge.joint or edge.free
        if joint and kind != "floating":
            lines += self._motion(joint)
        return [*lines, "  </joint>"]

    def _motion(self, joint: Joint) -> list[str]:
        lines = [f'    <axis xyz="{numbers(joint.axis)}"/>']
        limit, mimic = joint.limit, joint.mimic
        if joint.type in BOUNDED or limit:  # URDF requires effort and velocity in these cases
            effort, velocity = (
                (limit.effort or 0.0, limit.velocity or 0.0) if limit else (0.0, 0.0)
            )
            lower, upper = (limit.lower, limit.upper) if limit else (None, None)
            lines.append(
                _element(
                    "limit",
                    {"lower": lower, "upper": upper, "effort": effort, "velocity": velocity},
                )
            )
        named = (
            ("dynamics", joint.dynamics),
            ("safety_controller", joint.safety),
            ("calibration", joint.reference),
        )
        for tag, values in named:
            if values:
                lines.append(
                    _element(
                        tag, {field.name: getattr(values, field.name) for field in fields(values)}
                    )
                )
        if mimic is not None:
            multiplier, offset = number(joint.multiplier), number(joint.offset)
            lines.append(
                f'    <mimic joint={self.name(mimic)} multiplier="{multiplier}"'
                f' offset="{offset}"/>'
            )
        return lines

    def hardware(self, robot: Robot) -> list[str]:
        """Return the robot's hardware components in the form that ros2_control reads."""
        return [line for hardware in robot.hardware for line in self._hardware(hardware)]

    def _hardware(self, hardware: Hardware) -> list[str]:
        more = "" if hardware.rw_rate is None else f' rw_rate="{hardware.rw_rate}"'
        more += (
            "" if hardware.is_async is None else f' is_async="{str(hardware.is_async).lower()}"'
        )
        return [
            f'  <ros2_control name={self.name(hardware.name)} type="{hardware.type}"{more}>',
            "    <hardware>",
            f"      <plugin>{self.content(hardware.plugin)}</plugin>",
            *self._parameters(hardware.params),
            "    </hardware>",
            *(line for component in hardware.components for line in self._component(component)),
            "  </ros2_control>",
        ]

    def _component(self, component: HardwareComponent) -> list[str]:
        inside = [
            *(
                line
                for interface in component.command
                for line in self._interface("command_interface", interface)
            ),
            *(
                line
                for interface in component.state
                for line in self._interface("state_interface", interface)
            ),
            *self._parameters(component.params),
        ]
        head = f"    <{component.kind} name={self.name(component.name)}"
        return [f"{head}>", *inside, f"    </{component.kind}>"] if inside else [f"{head}/>"]

    def _parameters(self, params: dict[str, str]) -> list[str]:
        return [
            f"      <param name={self.value(name)}>{self.parameter(text)}</param>"
            for name, text in params.items()
        ]

    def _interface(self, tag: str, interface: Interface) -> list[str]:
        head = f"      <{tag} name={self.value(interface.name)}"
        head += "".join(
            f" {key}={self.value(interface.params[key])}"
            for key in ATTRIBUTES
            if key in interface.params
        )
        params = [
            f"        <param name={self.value(name)}>{self.content(text)}</param>"
            for name, text in interface.params.items()
            if name not in ATTRIBUTES
        ]
        return [f"{head}>", *params, f"      </{tag}>"] if params else [f"{head}/>"]


def _unknown(edge: Edge) -> str:
    text = (
        f"{edge.child} is not here, nor what is below it: only {edge.owner} knows where it is in"
        f" {edge.parent}"
    )
    return f"  <!-- {text.replace('--', '- -')} -->"


def _below(root: str, children: dict[str, list[Edge]]) -> Iterator[Edge]:
    """Yield the edges below ``root``, parents first, in order of declaration."""
    waiting = list(reversed(children.get(root, [])))
    while waiting:
        edge = waiting.pop()
        yield edge
        waiting += reversed(children.get(edge.child, []))


def _joint_names(edges: list[Edge]) -> list[str]:
    """Return a name for each edge's joint.

    By default it is ``parent_to_child``, with underscores added if that name is already used.
    """
    names_used = {edge.joint_name for edge in edges}
    names = []
    for edge in edges:
        name = edge.joint_name or f"{edge.parent}_to_{edge.child}"
        while not edge.joint_name and name in names_used:
            name += "_"
        names_used.add(name)
        names.append(name)
    return names


def joint_type(edge: Edge) -> str:
    """Return the URDF joint type of the edge."""
    joint = edge.joint or edge.free
    if joint:
        return joint.type
    # A sensor is a rigid body, even if its driver repeatedly publishes calibrated inner edges on
    # /tf.
    inside = edge.sensor and not edge.declared
    return "floating" if edge.kind == "dynamic" and not inside else "fixed"


def _origin(pose: Pose, before: str) -> list[str]:
    """Return the <origin> element, nothing for the identity."""
    if pose == _IDENTITY:
        return []
    return [
        f'{before}<origin xyz="{numbers(clean_xyz(pose.xyz))}"'  # noqa: ISC004
        f' rpy="{numbers(clean_rpy(pose.quat_xyzw))}"/>'
    ]


def with_pose(text: str, parent: str, child: str, pose: Pose) -> str:
    """Return a URDF of this module with another pose of ``child`` in ``parent``.

    Both may have a prefix that the URDF leaves out. An edge that the URDF does not have changes
    nothing.
    """
    for length in range(len(child)):
        if not parent.startswith(child[:length]):
            break
        ends = (
            f"    <parent link={quoted(parent[length:])}/>\n"
            f"    <child link={quoted(child[length:])}/>\n"
        )
        before, separator, after = text.partition(ends)
        if separator:
            origin = "".join(f"{line}\n" for line in _origin(pose, "    "))
            return f"{before}{ends}{origin}{_ORIGIN_LINE.sub('', after, count=1)}"
    return text


def _inertial(inertial: Inertial) -> list[str]:
    named = zip(MOMENTS, clean_tensor(inertial.tensor), strict=True)
    tensor = " ".join(f'{name}="{number(value)}"' for name, value in named)
    return [
        "    <inertial>",
        *_origin(inertial.pose, "      "),
        f'      <mass value="{number(inertial.mass)}"/>',
        f"      <inertia {tensor}/>",
        "    </inertial>",
    ]


def _element(tag: str, values: dict[str, float | None]) -> str:
    """Return an element of a joint, with the numbers that are not None."""
    attributes = " ".join(
        f'{name}="{number(value)}"' for name, value in values.items() if value is not None
    )
    return f"    <{tag} {attributes}/>"
