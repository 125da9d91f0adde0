"""A robot's tree as text, and as a graph to be drawn: frames, and at each edge its kind, owner, rate and pose."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from tfcompose.draw import Arrow, Graph, Group
from tfcompose.model import JOINTS, STATIC
from tfcompose.numbers import clean_rpy, clean_xyz, number
from tfcompose.tree import drawn

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.geometry import Pose
    from tfcompose.model import Edge, Robot


def tree(robot: Robot, columns: int | None = None) -> str:
    """Return the tree, one frame a line: kind, owner, rate; position in metres and rpy in degrees where not zero.

    Where that is wider than ``columns``, the facts follow each name at once, without the kinds that owners imply.
    """
    children = robot.children()
    rows: list[tuple[str, Edge | None]] = []
    for root in robot.roots():
        rows.append((root, None))
        rows += [(lines + edge.child, edge) for lines, edge in drawn(children, root, lambda edge: edge.child)]
    width = max((len(name) for name, _ in rows), default=0)
    owners = max((len(edge.owner) for _, edge in rows if edge), default=0)
    lines = [_row(name, edge, width, owners) for name, edge in rows]
    if columns is not None and max(map(len, lines), default=0) > columns:
        lines = [_tight(name, edge) for name, edge in rows]
    return "".join(f"{line}\n" for line in lines)


def _row(name: str, edge: Edge | None, width: int, owners: int) -> str:
    if edge is None:
        return name
    rate = f"{number(edge.rate)} Hz" if edge.rate else ""
    rest = "  ".join(fact for fact in (pose_text(edge), _switched(edge)) if fact)
    return f"{name:<{width}}  {edge.kind:<7}  {edge.owner:<{owners}}  {rate:<6}  {rest}".rstrip()


def _tight(name: str, edge: Edge | None) -> str:
    if edge is None:
        return name
    kind = "" if edge.owner in {STATIC, JOINTS} else edge.kind
    rate = f"{number(edge.rate)} Hz" if edge.rate else ""
    facts = (name, kind, edge.owner, rate, pose_text(edge), _switched(edge))
    return "  ".join(fact for fact in facts if fact)


def pose_text(edge: Edge) -> str:
    """Return the edge's pose as ``short_pose`` has it, or that only its owner knows it."""
    return short_pose(edge.pose) if edge.pose_known else "pose unknown"


def edge_facts(edge: Edge) -> str:
    """Return kind, owner, rate and pose of an edge, in one line."""
    rate = f"{number(edge.rate)} Hz" if edge.rate else ""
    facts = (edge.kind, f"by {edge.owner}", rate, pose_text(edge), _switched(edge))
    return "  ".join(fact for fact in facts if fact)


def _switched(edge: Edge) -> str:
    return f"or on {', '.join(edge.switched)}" if edge.switched else ""


def short_pose(pose: Pose) -> str:
    """Return position in metres and rotation (rpy) in degrees, as far as they are not zero."""
    parts = []
    xyz = clean_xyz(pose.xyz)
    if any(xyz):
        parts.append(f"xyz {' '.join(number(round(value, 6)) for value in xyz)}")
    rpy = clean_rpy(pose.quat_xyzw)
    if any(rpy):
        parts.append(f"rpy {' '.join(number(round(math.degrees(value), 4)) for value in rpy)} deg")
    return "  ".join(parts)


def graph_of(robot: Robot, *, poses: bool = False) -> Graph:
    """Return the tree of a robot with final names: sensors are groups, owners are in the order of the tree."""
    presets = {sensor.name: sensor.preset for sensor in robot.sensors}
    groups: dict[str, list[str]] = {}
    for edge in robot.edges:
        if edge.sensor:
            groups.setdefault(edge.sensor, []).append(edge.child)
    owners = dict.fromkeys(edge.owner for edge in robot.edges)
    built_in = [name for name in (STATIC, JOINTS) if name in owners]
    return Graph(
        robot.name,
        tuple(robot.frames),
        tuple(arrow for edge in robot.edges for arrow in _arrows(edge, poses=poses)),
        tuple(Group(_label(name, presets), tuple(frames)) for name, frames in groups.items()),
        tuple(dict.fromkeys((*built_in, *owners))),
    )


def _label(sensor: str, presets: dict[str, str]) -> str:
    return f"{sensor} · {presets[sensor]}" if sensor in presets else sensor


def _arrows(edge: Edge, *, poses: bool) -> Iterator[Arrow]:
    rate = f"{number(edge.rate)} Hz" if edge.rate else ""
    yield Arrow(edge.parent, edge.child, edge.kind, edge.owner, rate, pose_text(edge) if poses else "")
    for parent in edge.switched:
        yield Arrow(parent, edge.child, edge.kind, edge.owner, alternative=True)
