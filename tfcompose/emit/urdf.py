"""URDF: everything below the robot's base.

Conventions follow the URDF XML specification: a joint's origin is the pose of its child link in its parent link, rpy
are fixed-axis angles, an axis is given in the joint's frame.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from importlib import import_module
from typing import TYPE_CHECKING

from tfcompose.emit.bodies import link_lines, origin
from tfcompose.emit.markup import quoted
from tfcompose.files import AS_WRITTEN
from tfcompose.model import JOINTS, STATIC
from tfcompose.numbers import number, numbers

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.files import Target
    from tfcompose.model import Edge, Joint, Robot


def urdf(robot: Robot, *, full: bool, target: Target = AS_WRITTEN) -> str:
    """Return the URDF of everything below ``robot.base``, which must be there, in a right tree.

    With ``full`` it holds every edge as it is, whoever publishes it. Without, it is for a stock robot_state_publisher:
    edges of other owners are floating joints, which that node leaves alone. ``target`` says how files are addressed.
    """
    body = body_of(robot, target)
    return whole(robot, body.full if full else body.stock)


@dataclass(frozen=True, slots=True)
class Body:
    """A robot's links and joints as lines: with every edge as it is, and for a stock robot_state_publisher."""

    full: list[str]
    stock: list[str]


def body_of(robot: Robot, target: Target = AS_WRITTEN) -> Body:
    """Return the links and joints below ``robot.base``. The two ways to write them differ in few joints.

    For a stock publisher the root has no inertia: it has no use for one, and KDL, which it reads URDF with, takes none
    there and warns at each start.
    """
    if robot.base is None:
        raise ValueError(f"{robot.name} has no base")
    edges = list(_below(robot.base, robot.children()))
    links: list[str] = []
    for edge in edges:
        links += link_lines(edge.child, robot.links.get(edge.child), target)
    root = robot.links.get(robot.base)
    full = link_lines(robot.base, root, target) + links
    stock = link_lines(robot.base, root and replace(root, inertial=None), target) + links
    for edge, name in zip(edges, _joint_names(edges), strict=True):
        joint = _joint(edge, name, joint_type(edge))
        full += joint
        stock += joint if edge.owner in {STATIC, JOINTS} else _joint(edge, name, "floating")
    return Body(full, stock)


def whole(robot: Robot, body: list[str]) -> str:
    """Return the document with these links and joints, and with what stands beside them."""
    beside = _blocks(robot) if robot.hardware or robot.blocks else ()
    head = ('<?xml version="1.0"?>', f"<robot name={quoted(robot.name)}>")
    return "\n".join([*head, *body, *beside, "</robot>", ""])


def _blocks(robot: Robot) -> list[str]:
    lines: list[str] = import_module("tfcompose.emit.blocks").block_lines(robot.hardware, robot.blocks)
    return lines


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


def joint_type(edge: Edge) -> str:
    """Return what URDF calls the joint that the edge is."""
    joint = edge.joint or edge.free
    if joint:
        return joint.type
    # A sensor is one body, even where its driver sends what was calibrated inside it again and again.
    inside = edge.sensor and not edge.given
    return "floating" if edge.kind == "dynamic" and not inside else "fixed"


def _joint(edge: Edge, name: str, kind: str) -> list[str]:
    lines = [
        f'  <joint name={quoted(name)} type="{kind}">',
        f"    <parent link={quoted(edge.parent)}/>",
        f"    <child link={quoted(edge.child)}/>",
        *origin(edge.pose, "    "),
    ]
    joint = edge.joint or edge.free
    if joint and kind != "floating":
        lines += _motion(joint)
    return [*lines, "  </joint>"]


def _motion(joint: Joint) -> list[str]:
    lines = [f'    <axis xyz="{numbers(joint.axis)}"/>']
    limit, reference, mimic = joint.limit, joint.reference, joint.mimic
    if joint.type in {"revolute", "prismatic"} or limit:  # URDF requires effort and velocity of these
        effort, velocity = (limit.effort or 0.0, limit.velocity or 0.0) if limit else (0.0, 0.0)
        lower, upper = (limit.lower, limit.upper) if limit else (None, None)
        lines.append(_values("limit", lower=lower, upper=upper, effort=effort, velocity=velocity))
    if joint.dynamics:
        lines.append(_values("dynamics", damping=joint.dynamics.damping, friction=joint.dynamics.friction))
    if joint.safety:
        gains = {key: getattr(joint.safety, key) for key in joint.safety.__slots__}
        lines.append(_values("safety_controller", **gains))
    if reference:
        lines.append(_values("calibration", rising=reference.rising, falling=reference.falling))
    if mimic is not None:
        multiplier, offset = number(joint.multiplier), number(joint.offset)
        lines.append(f'    <mimic joint={quoted(mimic)} multiplier="{multiplier}" offset="{offset}"/>')
    return lines


def _values(tag: str, **values: float | None) -> str:
    said = " ".join(f'{name}="{number(value)}"' for name, value in values.items() if value is not None)
    return f"    <{tag} {said}/>"
