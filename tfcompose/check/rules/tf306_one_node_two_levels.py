"""TF306: one node two levels."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.findings import Finding, Note, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Edge, Robot


def one_node_two_levels(robot: Robot) -> Iterator[Finding]:
    """One node publishes both map → odom and odom → base_link.

    REP-105 keeps the two apart: odometry is continuous and drifts, localisation corrects it in jumps. A node that
    computes one pose and splits it gives an odometry that jumps too, and controllers see it; with robot_localization it
    means that one filter is set to both. Run two, ``world_frame: odom`` and ``world_frame: map``. Drivers of sensors
    that do both by themselves (visual odometry inside a camera) and stand-ins are left alone.
    """
    sensors = {sensor.driver for sensor in robot.sensors}
    owners = {p.name: p for p in robot.processes if p.kind in {"run", "external"} and p.name not in sensors}
    upper = {edge.child: edge for edge in robot.edges if _ends(edge, "map", {"odom"})}
    for edge in robot.edges:
        if _ends(edge, "odom", {"base_link", "base_footprint"}) and edge.owner in owners:
            other = upper.get(edge.parent)
            if other and other.owner == edge.owner:
                message = f"{edge.owner} publishes both {other.name} and {edge.name}"
                notes = [Note(f"{other.name} stands here", other.owner_at or other.at)]
                advice = "one process for localisation, another for odometry"
                yield finding("TF306", message, edge.owner_at or edge.at, help=advice, notes=notes)


def _ends(edge: Edge, parent: str, children: set[str]) -> bool:
    return edge.parent.rpartition("/")[2] == parent and edge.child.rpartition("/")[2] in children
