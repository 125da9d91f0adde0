"""A robot's tree as text, and as a graph for drawing.

Each edge is shown with kind, owner, rate and pose.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from tfcompose.compiler.draw import Arrow, Graph, Group
from tfcompose.foundation.numbers import clean_rpy, clean_xyz, number
from tfcompose.foundation.tree import draw_tree
from tfcompose.model.robot import JOINTS, STATIC

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator, Sequence

    from tfcompose.foundation.geometry import Pose
    from tfcompose.model.robot import Edge, Robot


#: Separator between the facts of a line.
GAP = "  "


def tree(robot: Robot, columns: int | None = None) -> str:
    """Return the tree as text, a frame on each line.

    After the frame follow its edge's kind, owner, rate and pose. The pose is the position in
    metres and rpy in degrees; zero values are left out. Lines wider than ``columns`` are shortened
    in three steps. First, facts directly follow the name, and a kind that the owner implies is
    omitted. Next, the kind ``static`` is omitted for any owner. Finally, facts continue on the
    next line.
    """
    children = robot.children()
    rows = [
        row
        for root in robot.roots()
        for row in (
            ("", root, None),
            *((lines, edge.child, edge) for lines, edge in draw_tree(children, root, _child)),
        )
    ]
    width = max((len(lines) + len(name) for lines, name, _ in rows), default=0)
    owners = max((len(edge.owner) for _, _, edge in rows if edge), default=0)
    lines = [_row(lines + name, edge, width, owners) for lines, name, edge in rows]
    if columns is not None and _widest(lines) > columns:
        lines = _fit_rows(rows, columns)
    return "".join(f"{line}\n" for line in lines)


def _child(edge: Edge) -> str:
    return edge.child


def _widest(lines: Iterable[str]) -> int:
    return max(map(len, lines), default=0)


def _row(name: str, edge: Edge | None, width: int, owners: int) -> str:
    if edge is None:
        return name
    columns = (
        f"{name:<{width}}",
        f"{edge.kind:<7}",
        f"{edge.owner:<{owners}}",
        f"{_rate(edge):<6}",
    )
    rest = [fact for fact in (pose_text(edge), _switch_of(edge)) if fact]
    return "  ".join([*columns, *rest]).rstrip()


def _fit_rows(rows: Sequence[tuple[str, str, Edge | None]], columns: int) -> list[str]:
    """Return the rows as lines of at most ``columns`` columns, if the names fit."""
    for kinds in ({"static", "joints", "dynamic"}, {"dynamic"}):
        facts = [_facts(edge, kinds) for _, _, edge in rows]
        drawing = [(lines, name, some) for (lines, name, _), some in zip(rows, facts, strict=True)]
        fitted = [GAP.join([lines + name, *some]) for lines, name, some in drawing]
        if _widest(fitted) <= columns:
            return fitted
    return [line for some in wrap_rows(drawing, columns) for line in some]


def wrap_rows(rows: Sequence[tuple[str, str, Sequence[str]]], columns: int) -> list[list[str]]:
    """Return, for each row of a tree, lines of at most ``columns`` columns.

    A row is the tree lines, a name, and facts. Facts that do not fit continue on the next line. If
    a name does not fit, each level is indented by only two columns.
    """
    if _widest(lines + name for lines, name, _ in rows) > columns:
        rows = [(_narrow(lines), name, facts) for lines, name, facts in rows]
    below = [*(lines for lines, _, _ in rows[1:]), ""]
    return [
        list(_wrap_row(lines, name, facts, columns, has_children=len(after) > len(lines)))
        for (lines, name, facts), after in zip(rows, below, strict=True)
    ]


def _facts(edge: Edge | None, kinds: Collection[str]) -> list[str]:
    """Return the facts about an edge.

    They include its kind if ``kinds`` contains the kind and the owner does not imply it.
    """
    if edge is None:
        return []
    kind = edge.kind if edge.kind in kinds and edge.owner not in {STATIC, JOINTS} else ""
    facts = (kind, edge.owner, _rate(edge), *pose_text(edge).split(GAP), _switch_of(edge))
    return [fact for fact in facts if fact]


def _narrow(lines: str) -> str:
    """Return the tree lines with two columns for each level instead of four."""
    return lines.replace("│   ", "│ ").replace("    ", "  ").replace("── ", " ")


def _wrap_row(
    lines: str, name: str, facts: Iterable[str], columns: int, *, has_children: bool
) -> Iterator[str]:
    line = lines + name
    more = lines.replace("├──", "│  ").replace("├ ", "│ ").replace("└", " ").replace("─", " ")
    more += "│   " if has_children else "    "
    for fact in facts:
        if len(line) + len(GAP) + len(fact) > columns:
            yield line
            line = more + fact
        else:
            line += GAP + fact
    yield line


def _rate(edge: Edge) -> str:
    return f"{number(edge.rate)} Hz" if edge.rate else ""


def pose_text(edge: Edge) -> str:
    """Return the edge's pose as in ``short_pose``.

    If only the owner knows the pose, return "pose unknown".
    """
    return short_pose(edge.pose) if edge.pose_known else "pose unknown"


def edge_facts(edge: Edge) -> str:
    """Return kind, owner, rate and pose of an edge on a single line."""
    facts = (edge.kind, f"by {edge.owner}", _rate(edge), pose_text(edge), _switch_of(edge))
    return GAP.join(fact for fact in facts if fact)


def _switch_of(edge: Edge) -> str:
    return f"or on {', '.join(edge.switched)}" if edge.switched else ""


def short_pose(pose: Pose) -> str:
    """Return the position in metres and rpy in degrees; zero values are left out."""
    parts = []
    xyz = clean_xyz(pose.xyz)
    if any(xyz):
        parts.append(f"xyz {' '.join(number(round(value, 6)) for value in xyz)}")
    rpy = clean_rpy(pose.quat_xyzw)
    if any(rpy):
        parts.append(f"rpy {' '.join(number(round(math.degrees(value), 4)) for value in rpy)} deg")
    return GAP.join(parts)


def graph_of(robot: Robot, *, poses: bool = False) -> Graph:
    """Return the robot's tree as a graph, with final names.

    Each sensor is a group. Owners are in tree order.
    """
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
    yield Arrow(
        edge.parent,
        edge.child,
        edge.kind,
        owner=edge.owner,
        detail=_rate(edge),
        pose=pose_text(edge) if poses else "",
    )
    for parent in edge.switched:
        yield Arrow(parent, edge.child, edge.kind, edge.owner, alternative=True)
