"""TF815: process without role."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.findings import Finding, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Robot


def process_without_role(robot: Robot) -> Iterator[Finding]:
    """A process that somebody else starts, or a stand-in, has nothing to do with the robot.

    It owns no edge, no sensor is driven by it and nothing waits for it: probably an ``owner`` was meant to name it.
    Give it its edge, or remove it. Programs that tfcompose starts may do what they like, and a process that somebody
    else starts may send the joint states where no stand-in does.
    """
    owners = {edge.owner for edge in robot.edges}
    drivers = {sensor.driver for sensor in robot.sensors}
    awaited = {name for process in robot.processes for name in process.after}
    publishers = {claim.node for claim in robot.claims}
    busy = owners | drivers | awaited | {process.name for process in robot.processes if process.node in publishers}
    names = {process.name for process in robot.processes}
    if (owners | drivers) - names - {""}:
        return  # a name is misspelt, and that has been said
    moving = any(edge.joint for edge in robot.edges)
    states = any(process.simulate and process.simulate.kind == "joints" for process in robot.processes)
    for process in robot.processes:
        if process.kind not in {"external", "simulate"} or process.name in busy or robot.excuses(process.name):
            continue
        if process.kind == "external" and moving and not states:
            continue
        if process.simulate and process.simulate.kind == "joints" and moving:
            continue
        what = "no joint moves" if process.simulate and process.simulate.kind == "joints" else "it owns no edge"
        advice = "remove it"
        if "edge" in what:
            advice = f"owner: {process.name} at the edge that it publishes, or remove it"
        message = f"{process.name} has nothing to do here: {what}"
        yield finding("TF815", message, process.at, help=advice)
