"""TF205: edge given twice."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.findings import Finding, Note, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Edge, Robot


def edge_given_twice(robot: Robot) -> Iterator[Finding]:
    """One edge stands in two places.

    Both would be published, and which value counts depends on who joins when. Keep the one that is measured.
    """
    first: dict[tuple[str, str], Edge] = {}
    for edge in robot.edges:
        other = first.setdefault((edge.parent, edge.child), edge)
        if other is not edge and other.owner == edge.owner:
            notes = [Note("it stands here first", other.at)]
            yield finding("TF205", f"the edge {edge.name} is given twice", edge.at, notes=notes, help="remove one")
