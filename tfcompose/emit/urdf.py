"""URDF: everything below the robot's base.

Conventions follow the URDF XML specification: a joint's origin is the pose of its child link in its parent link, rpy
are fixed-axis angles, an axis is given in the joint's frame.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.emit.bodies import link_lines, origin
from tfcompose.emit.markup import quoted
from tfcompose.emit.numbers import number, numbers
from tfcompose.emit.target import AS_WRITTEN
from tfcompose.model import JOINTS, STATIC

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.emit.target import Target
    from tfcompose.model import Edge, Joint, Robot


def urdf(robot: Robot, *, full: bool, target: Target = AS_WRITTEN) -> str:
    """Return the URDF of everything below ``robot.base``, which must be there, in a right tree.

    With ``full`` it holds every edge as it is, whoever publishes it. Without, it is for a stock robot_state_publisher:
    edges of other owners are floating joints, which that node leaves alone. ``target`` says how files are addressed.
    """
    whole, stock = urdfs(robot, target)
    return whole if full else stock


def urdfs(robot: Robot, target: Target = AS_WRITTEN) -> tuple[str, str]:
    """Return both: with every edge as it is, and for a stock robot_state_publisher. They differ in few joints."""
    if robot.base is None:
        raise ValueError(f"{robot.name} has no base")
    edges = list(_below(robot.base, robot.children()))
    links = ['<?xml version="1.0"?>', f"<robot name={quoted(robot.name)}>"]
    for frame in [robot.base, *(edge.child for edge in edges)]:
        links += link_lines(frame, robot.links.get(frame), target)
    whole, stock = list(links), links
    for edge, name in zip(edges, _joint_names(edges), strict=True):
        joint = _joint(edge, name, _kind(edge))
        whole += joint
        stock += joint if edge.owner in {STATIC, JOINTS} else _joint(edge, name, "floating")
    end = ["</robot>", ""]
    return "\n".join([*whole, *end]), "\n".join([*stock, *end])


def _below(root: str, children: dict[str, list[Edge]]) -> Iterator[Edge]:
    """Yield the edges below ``root``, parents first, siblings as declared; without recursion."""
    waiting = list(reversed(children.get(root, [])))
    while waiting:
        edge = waiting.pop()
        yield edge
        waiting += reversed(children.get(edge.child, []))


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


def _kind(edge: Edge) -> str:
    if edge.joint:
        return edge.joint.type
    return "floating" if edge.kind == "dynamic" else "fixed"


def _joint(edge: Edge, name: str, kind: str) -> list[str]:
    lines = [
        f'  <joint name={quoted(name)} type="{kind}">',
        f"    <parent link={quoted(edge.parent)}/>",
        f"    <child link={quoted(edge.child)}/>",
        *origin(edge.pose, "    "),
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
        lines.append(f'    <mimic joint={quoted(joint.mimic)} multiplier="{multiplier}" offset="{offset}"/>')
    return lines
