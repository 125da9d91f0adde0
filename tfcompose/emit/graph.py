"""The robot's tree as a graph to be drawn."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.draw import Arrow, Graph, Group
from tfcompose.emit.numbers import number
from tfcompose.emit.tree import pose_text
from tfcompose.model import JOINTS, STATIC

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Edge, Robot


def graph_of(robot: Robot, *, poses: bool = False) -> Graph:
    """Return the tree of a robot with final names: sensors are groups, owners stand in the order of the tree."""
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
