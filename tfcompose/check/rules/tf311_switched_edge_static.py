"""TF311: switched edge static."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.findings import Finding, finding
from tfcompose.model import BUILT_IN

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Robot


def switched_edge_static(robot: Robot) -> Iterator[Finding]:
    """An edge that changes its parent is sent on /tf_static.

    What came on /tf_static holds at every time, also before the change: a lookup in the past finds the tool where it
    is now. And it never runs out: when the tool changer dies, or another writer takes over, listeners that run keep the
    parent that they heard of last. Send the edge again and again on /tf, and remove ``static: true``.
    """
    for edge in robot.edges:
        if edge.switched and edge.kind == "static" and edge.owner not in BUILT_IN:
            parents = ", ".join((edge.parent, *edge.switched))
            message = f"{edge.owner} sends {edge.child} on /tf_static, and changes its parent: {parents}"
            yield finding("TF311", message, edge.at, help="send it on /tf with a rate, and remove static: true")
