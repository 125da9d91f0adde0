"""TF818: required without role."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.findings import Finding, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Robot


def required_without_role(robot: Robot) -> Iterator[Finding]:
    """A process is required, owns no edge, and nothing waits for it.

    When it ends, the whole robot is stopped; yet nothing here needs it. Leave ``required`` out, or say who needs it:
    ``after: {NAME: ready}`` at the process that does.
    """
    owners = {edge.owner for edge in robot.edges}
    drivers = {sensor.driver for sensor in robot.sensors}
    awaited = {name for process in robot.processes for name in process.after}
    publishers = {claim.node for claim in robot.claims}
    for process in robot.processes:
        needed = process.name in owners | drivers | awaited or any(node.name in publishers for node in process.nodes)
        if process.required and not needed and not robot.excuses(process.name):
            message = f"{process.name} is required, owns no edge, and nothing waits for it"
            advice = f"leave required out, or after: {{{process.name}: ready}} at what needs it"
            yield finding("TF818", message, process.at, help=advice)
