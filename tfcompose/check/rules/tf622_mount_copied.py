"""TF622: mount copied."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.check.geometry import are_mirrored, twins
from tfcompose.findings import Finding, Note, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Edge, Robot


def mount_copied(robot: Robot) -> Iterator[Finding]:
    """The left one is where the right one is, or the front one where the rear one is.

    Both have the same position in the same parent, away from the middle: the entry was copied, and its sign forgotten.
    By REP-103 y is positive to the left, x to the front. Example: ``wheel_left_link`` at y = 0.2 has its twin at −0.2.
    """
    given: dict[str, Edge] = {}
    for edge in robot.edges:
        if not edge.given:
            continue
        twin = next((given[name] for name in twins(edge.child) if name in given), None)
        given.setdefault(edge.child, edge)
        if twin and are_mirrored(twin, edge):
            x, y, z = edge.pose.xyz
            message = f"{edge.child} and {twin.child} are both at [{x:g}, {y:g}, {z:g}] in {edge.parent}"
            notes = [Note(f"{twin.child} stands here", twin.at)]
            advice = "y is positive to the left, x to the front: one of the two has another sign"
            yield finding("TF622", message, edge.at, help=advice, notes=notes)
