"""TF309: many static publishers."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.findings import Finding, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Robot

MOST = 50


def many_static_publishers(robot: Robot) -> Iterator[Finding]:
    """More than 50 processes publish fixed edges.

    Every listener keeps the last 100 messages on /tf_static and gets one from each publisher when it joins: from about
    100 publishers on edges are lost, now these and now those (geometry2#398), and each publisher costs a process and
    its discovery. Let tfcompose publish fixed edges, all in one message: leave ``owner`` out, and ``tf: tfcompose`` at
    sensors.
    """
    first = {edge.owner: edge for edge in reversed(robot.edges) if edge.kind == "static"}
    if len(first) > MOST:
        listed = sorted(first)
        message = f"{len(first)} processes publish fixed edges: {', '.join(listed[:3])}, …"
        last = max(first.values(), key=lambda edge: (edge.at.line, edge.at.column))
        advice = "let tfcompose publish them: leave owner out, and tf: tfcompose at sensors"
        yield finding("TF309", message, last.owner_at or last.at, help=advice)
