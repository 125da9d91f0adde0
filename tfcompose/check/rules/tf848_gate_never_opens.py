"""TF848: gate never opens."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.findings import Finding, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Robot


def gate_never_opens(robot: Robot) -> Iterator[Finding]:
    """A process is ready by what cannot come: the edges of one that owns none, or the end of one that always runs.

    It stays not ready, and so does what waits for it. Say by what it is ready, leave ``ready`` out, or take
    ``restart: always`` away.
    """
    owners = {edge.owner for edge in robot.edges}
    for process in robot.processes:
        kind = process.ready.kind if process.ready else ""
        if kind == "edges" and process.name not in owners:
            message = f"{process.name} is ready when its edges are live, and it owns none"
            yield finding(
                "TF848", message, process.at, help="leave ready out, or say what else shows it: a topic, a line"
            )
        elif kind == "exit" and process.restart == "always":
            message = f"{process.name} is ready when it has ended, and restart: always starts it again"
            yield finding("TF848", message, process.at, help="restart: on-failure, or leave it out")
