"""URDF of a robot: everything below its base.

Conventions follow the URDF XML specification: a joint's origin is the pose of its child link in
its parent link, rpy are fixed-axis angles, an axis is given in the joint's frame.
"""

from __future__ import annotations

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
#: The value of an attribute, in quotes. Names repeat, in one file and from file to file.
quoted = lru_cache(maxsize=1 << 16)(quoteattr)


def urdf(robot: Robot, target: Target = AS_IN_SOURCE) -> tuple[str, str]:
    """Return the URDF below ``robot.base``, in full and for a stock publisher.

    The base must exist, in a valid tree. The full URDF has every edge as it is, whoever publishes
    it. For a stock robot_state_publisher, edges of other owners are floating joints, which that
    node ignores. ``target`` says how files are addressed.
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

    Subclasses can change the spelling of names and values.
    """

    def __init__(self, target: Target = AS_IN_SOURCE) -> None:
        self.target = target

    def name(self, text: str) -> str:
        """Return the quoted name of a link, joint, material or piece of hardware."""
        return quoted(text)

    def value(self, text: str) -> str:
        """Return the value of any other attribute in quotes."""
        return quoted(text)

    def content(self, text: str) -> str:
        """Return the content of an element."""
        return escape(text)

    def parameter(self, text: str) -> str:
        """Return the content of a hardware parameter."""
        return self.content(text)

    def address(self, asset: Asset) -> str:
        """Return the address of a mesh or texture, as an attribute's value in quotes."""
        return quoted(self.target.address(asset))

    def body(self, robot: Robot) -> tuple[list[str], list[str]]:
        """Return the URDF elements below ``robot.base``, in full and for a stock publisher.

        A frame of unknown pose is omitted with the frames below it, and a comment says so. For a
        stock publisher the root has no inertia: KDL, which that node uses to read URDF, supports
        none there and warns at each start.

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
        """Return the solids that the shape consists of, each with its pose.

        URDF has no capsule in the versions that ROS 2 Jazzy reads, and parsers reject the whole
        robot for one: it is written as the cylinder and the two spheres that together are the same
        solid.
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
        """Return the joint of this type for an edge."""
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
        if joint.type in BOUNDED or limit:  # URDF requires effort and velocity of these
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
        """Return the robot's hardware components, as ros2_control reads them."""
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
    """Yield the edges below ``root``, parents first, siblings as declared; without recursion."""
    waiting = list(reversed(children.get(root, [])))
    while waiting:
        edge = waiting.pop()
        yield edge
        waiting += reversed(children.get(edge.child, []))


def _joint_names(edges: list[Edge]) -> list[str]:
    """Return a name for each edge's joint.

    The user's, or ``parent_to_child``, longer where that is taken.
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
    """Return URDF's joint type of the edge."""
    joint = edge.joint or edge.free
    if joint:
        return joint.type
    # A sensor is one body, even where its driver sends what was calibrated inside it again and
    # again.
    inside = edge.sensor and not edge.declared
    return "floating" if edge.kind == "dynamic" and not inside else "fixed"


def _origin(pose: Pose, before: str) -> list[str]:
    """Return the origin element, or none for the identity."""
    if pose == _IDENTITY:
        return []
    return [
        f'{before}<origin xyz="{numbers(clean_xyz(pose.xyz))}"'  # noqa: ISC004
        f' rpy="{numbers(clean_rpy(pose.quat_xyzw))}"/>'
    ]


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
    """Return an element in a joint with the numbers that are not None."""
    attributes = " ".join(
        f'{name}="{number(value)}"' for name, value in values.items() if value is not None
    )
    return f"    <{tag} {attributes}/>"
