"""TF305: static edge with rate."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.findings import Finding, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Robot


def static_edge_with_rate(robot: Robot) -> Iterator[Finding]:
    """An edge that is sent once says how often it is sent.

    Fixed edges go out once on /tf_static and are kept by every listener; a rate has no meaning there, and the edge's
    owner is probably missing. Remove the rate, or name the process that sends the edge again and again:
    ``odom: {parent: map, owner: slam, rate: 10 Hz}``.
    """
    for edge in robot.edges:
        if edge.kind == "static" and edge.rate is not None and not robot.excuses(edge.owner):
            message = f"{edge.name} is fixed, and is sent once; the rate {edge.rate:g} Hz has no meaning"
            advice = "remove the rate" if edge.owner_at else "remove the rate, or name the owner that sends it"
            yield finding("TF305", message, edge.rate_at or edge.at, help=advice)
