"""TF310: switched edge without owner."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.findings import Finding, finding
from tfcompose.model import BUILT_IN

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Robot


def switched_edge_without_owner(robot: Robot) -> Iterator[Finding]:
    """An edge has several parents and nobody who changes between them.

    With ``parent: [tool0, rack_1]`` a tool hangs now on the arm and now in its rack. Who knows which is a process of
    yours, and it publishes the edge: ``owner: tool_changer``. What tfcompose publishes stays on one parent.
    """
    for edge in robot.edges:
        if edge.switched and edge.owner in BUILT_IN:
            message = f"{edge.child} hangs on {edge.parent} or {' or '.join(edge.switched)}, and {edge.owner} owns it"
            advice = "name the process that publishes it, owner: …, or keep one parent"
            yield finding("TF310", message, edge.at, help=advice)
