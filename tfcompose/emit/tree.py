"""The tree as text: frames, and at each edge its kind, owner and pose."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from tfcompose.emit.numbers import clean_rpy, clean_xyz, number

if TYPE_CHECKING:
    from tfcompose.geometry import Pose
    from tfcompose.model import Edge, Robot


def tree(robot: Robot) -> str:
    """Return the tree, one frame a line: kind, owner, rate; position in metres and rpy in degrees where not zero."""
    children = robot.children()
    rows: list[tuple[str, Edge | None]] = []
    for root in robot.roots():
        rows.append((root, None))
        waiting = [("", edge, edge is last) for last in children.get(root, [])[-1:] for edge in children[root]][::-1]
        while waiting:
            indent, edge, is_last = waiting.pop()
            rows.append((f"{indent}{'└── ' if is_last else '├── '}{edge.child}", edge))
            below = children.get(edge.child, [])
            deeper = indent + ("    " if is_last else "│   ")
            waiting += [(deeper, child, child is below[-1]) for child in below][::-1]
    width = max((len(name) for name, _ in rows), default=0)
    owners = max((len(edge.owner) for _, edge in rows if edge), default=0)
    return "".join(f"{_row(name, edge, width, owners)}\n" for name, edge in rows)


def _row(name: str, edge: Edge | None, width: int, owners: int) -> str:
    if edge is None:
        return name
    rate = f"{number(edge.rate)} Hz" if edge.rate else ""
    rest = "  ".join(part for part in (pose_text(edge), _switched(edge)) if part)
    said = f"{name:<{width}}  {edge.kind:<7}  {edge.owner:<{owners}}  {rate:<6}  {rest}"
    return said.rstrip()


def edge_facts(edge: Edge) -> str:
    """Return kind, owner, rate and pose of an edge, in one line."""
    rate = f"{number(edge.rate)} Hz" if edge.rate else ""
    return "  ".join(part for part in (edge.kind, f"by {edge.owner}", rate, pose_text(edge), _switched(edge)) if part)


def _switched(edge: Edge) -> str:
    return f"or on {', '.join(edge.switched)}" if edge.switched else ""


def pose_text(edge: Edge) -> str:
    """Return position and rotation of an edge, as far as they are not zero."""
    return pose_words(edge.pose)


def pose_words(pose: Pose) -> str:
    """Return position in metres and rotation (rpy) in degrees, as far as they are not zero."""
    parts = []
    xyz = clean_xyz(pose.xyz)
    if any(xyz):
        parts.append(f"xyz {' '.join(number(round(value, 6)) for value in xyz)}")
    rpy = clean_rpy(pose.quat_xyzw)
    if any(rpy):
        parts.append(f"rpy {' '.join(number(round(math.degrees(value), 4)) for value in rpy)} deg")
    return "  ".join(parts)
