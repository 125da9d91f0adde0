"""TF301: edge with two owners."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.findings import Finding, Note, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Edge, Robot


def edge_with_two_owners(robot: Robot) -> Iterator[Finding]:
    """Two processes would publish one edge.

    tf2 takes the last writer without a word, so the frame flickers between two values. Each edge has one owner: leave
    the edge to the driver, or switch the driver off with ``tf: tfcompose``.
    """
    first: dict[tuple[str, str], Edge] = {}
    for edge in robot.edges:
        other = first.setdefault((edge.parent, edge.child), edge)
        if other.owner != edge.owner:
            message = f"the edge {edge.name} has two owners: {other.owner} and {edge.owner}"
            notes = [Note(f"{other.owner} owns it here", other.owner_at or other.at)]
            place = edge.owner_at or edge.at
            yield finding("TF301", message, place, notes=notes, help="remove one of the two, or its owner")
