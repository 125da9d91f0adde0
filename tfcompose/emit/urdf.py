"""URDF: everything below the robot's base.

Conventions follow the URDF XML specification: a joint's origin is the pose of its child link in its parent link, rpy
are fixed-axis angles, an axis is given in the joint's frame.
"""

from __future__ import annotations

from typing import TYPE_CHECKING
from xml.sax.saxutils import quoteattr

from tfcompose.emit.numbers import clean_rpy, clean_tensor, clean_xyz, number, numbers
from tfcompose.model import JOINTS, STATIC
from tfcompose.pose import Pose

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Edge, Inertial, Joint, Link, Robot, Shape


def urdf(robot: Robot, *, full: bool) -> str:
    """Return the URDF of everything below ``robot.base``, which must be there, in a right tree.

    With ``full`` it holds every edge as it is, whoever publishes it. Without, it is for a stock robot_state_publisher:
    edges of other owners are floating joints, which that node leaves alone.
    """
    if robot.base is None:
        raise ValueError(f"{robot.name} has no base")
    lines = ['<?xml version="1.0"?>', f"<robot name={quoteattr(robot.name)}>"]
    children = robot.children()
    edges = list(_below(robot.base, children))
    for frame in [robot.base, *(edge.child for edge in edges)]:
        lines += _link(frame, robot.links.get(frame))
    for edge, name in zip(edges, _joint_names(edges), strict=True):
        lines += _joint(edge, name, full=full)
    return "\n".join([*lines, "</robot>", ""])


def _below(root: str, children: dict[str, list[Edge]]) -> Iterator[Edge]:
    """Yield the edges below ``root``, parents first, siblings as declared; without recursion."""
    waiting = list(reversed(children.get(root, [])))
    while waiting:
        edge = waiting.pop()
        yield edge
        waiting += reversed(children.get(edge.child, []))


def _link(name: str, link: Link | None) -> list[str]:
    body: list[str] = []
    if link and link.inertial:
        body += _inertial(link.inertial)
    for shape in link.visuals if link else ():
        body += _shape("visual", shape)
    for shape in link.collisions if link else ():
        body += _shape("collision", shape)
    if not body:
        return [f"  <link name={quoteattr(name)}/>"]
    return [f"  <link name={quoteattr(name)}>", *body, "  </link>"]


def _inertial(inertial: Inertial) -> list[str]:
    named = zip(("ixx", "ixy", "ixz", "iyy", "iyz", "izz"), clean_tensor(inertial.tensor), strict=True)
    tensor = " ".join(f'{name}="{number(value)}"' for name, value in named)
    return [
        "    <inertial>",
        *_origin(inertial.pose, "      "),
        f'      <mass value="{number(inertial.mass)}"/>',
        f"      <inertia {tensor}/>",
        "    </inertial>",
    ]


def _shape(tag: str, shape: Shape) -> list[str]:
    if shape.kind == "box":
        geometry = f'<box size="{numbers(shape.size)}"/>'
    elif shape.kind == "cylinder":
        geometry = f'<cylinder radius="{number(shape.size[0])}" length="{number(shape.size[1])}"/>'
    else:
        geometry = f'<sphere radius="{number(shape.size[0])}"/>'
    material = []
    if shape.material and tag == "visual":
        colour = f'<color rgba="{numbers(shape.material.rgba)}"/>'
        material = [f"      <material name={quoteattr(shape.material.name)}>{colour}</material>"]
    origin = _origin(shape.pose, "      ")
    return [f"    <{tag}>", *origin, f"      <geometry>{geometry}</geometry>", *material, f"    </{tag}>"]


def _origin(pose: Pose, indent: str) -> list[str]:
    if pose == Pose():
        return []
    return [f'{indent}<origin xyz="{numbers(clean_xyz(pose.xyz))}" rpy="{numbers(clean_rpy(pose.quat_xyzw))}"/>']


def _joint_names(edges: list[Edge]) -> list[str]:
    """Return a name for each edge's joint: the user's, or ``parent_to_child``, longer where that is taken."""
    taken = {edge.joint_name for edge in edges}
    names = []
    for edge in edges:
        name = edge.joint_name or f"{edge.parent}_to_{edge.child}"
        while not edge.joint_name and name in taken:
            name += "_"
        taken.add(name)
        names.append(name)
    return names


def _joint(edge: Edge, name: str, *, full: bool) -> list[str]:
    ours = edge.owner in {STATIC, JOINTS}
    kind: str = edge.joint.type if edge.joint else "fixed"
    if (not full and not ours) or (edge.kind == "dynamic" and not edge.joint):
        kind = "floating"
    lines = [
        f'  <joint name={quoteattr(name)} type="{kind}">',
        f"    <parent link={quoteattr(edge.parent)}/>",
        f"    <child link={quoteattr(edge.child)}/>",
        *_origin(edge.pose, "    "),
    ]
    if edge.joint and kind != "floating":
        lines += _motion(edge.joint)
    return [*lines, "  </joint>"]


def _motion(joint: Joint) -> list[str]:
    lines = [f'    <axis xyz="{numbers(joint.axis)}"/>']
    limit = joint.limit
    if joint.type != "continuous" or limit:
        said = [
            ("lower", limit.lower if limit else None),
            ("upper", limit.upper if limit else None),
            ("effort", (limit.effort if limit else None) or 0.0),
            ("velocity", (limit.velocity if limit else None) or 0.0),
        ]
        values = " ".join(f'{name}="{number(value)}"' for name, value in said if value is not None)
        lines.append(f"    <limit {values}/>")
    if joint.mimic is not None:
        multiplier, offset = number(joint.multiplier), number(joint.offset)
        lines.append(f'    <mimic joint={quoteattr(joint.mimic)} multiplier="{multiplier}" offset="{offset}"/>')
    return lines
