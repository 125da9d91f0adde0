"""TF201: two parents."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.findings import Finding, Note, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Edge, Robot


def two_parents(robot: Robot) -> Iterator[Finding]:
    """A frame hangs on two parents.

    tf2 keeps one parent for each frame, that of the newest message, and says nothing: the frame jumps between the two.
    Decide which one is meant. A camera whose driver publishes its own chain is mounted by the chain's first frame.
    """
    first: dict[str, Edge] = {}
    for edge in robot.edges:
        other = first.setdefault(edge.child, edge)
        if other.parent != edge.parent:
            message = f"{edge.child} has two parents: {other.parent} and {edge.parent}"
            notes = [Note(f"{other.name}, owned by {other.owner}, stands here", other.at)]
            yield finding("TF201", message, edge.at, notes=notes, help="keep one of the two edges")
