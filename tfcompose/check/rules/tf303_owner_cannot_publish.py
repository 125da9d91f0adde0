"""TF303: owner cannot publish."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.findings import Finding, finding
from tfcompose.model import BUILT_IN

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Robot


def owner_cannot_publish(robot: Robot) -> Iterator[Finding]:
    """The owner is a process that does not publish edges of this kind.

    ``static`` publishes what never moves, ``joints`` what moves by joint states, ``guard`` and a source of joint states
    publish no edges.
    """
    processes = {process.name: process for process in robot.processes}
    for edge in robot.edges:
        process = processes.get(edge.owner)
        if process is None or (edge.free and edge.owner in BUILT_IN):  # TF715 says that
            continue
        reason = ""
        if process.kind == "guard":
            reason = "guard only watches"
        elif process.kind == "joints" and not edge.joint:
            reason = "joints publishes moving joints only"
        elif process.kind == "static" and edge.joint:
            reason = "static publishes fixed edges only"
        elif process.simulate and process.simulate.kind == "joints":
            reason = f"{process.name} sends joint states, not edges"
        if reason:
            message = f"{edge.owner} cannot publish {edge.name}: {reason}"
            yield finding("TF303", message, edge.owner_at or edge.at, help="leave the owner out, or name another")
