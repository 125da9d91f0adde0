"""Rules about processes: what they wait for, and what they are there for."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.check.rule import rule
from tfcompose.findings import Finding, Note, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Robot


@rule("TF812")
def start_order_loop(robot: Robot) -> Iterator[Finding]:
    """Processes wait for each other.

    None of them would ever be started.
    """
    waiting = {process.name: process for process in robot.processes}
    while free := [name for name, p in waiting.items() if not any(other in waiting for other in p.after)]:
        for name in free:
            del waiting[name]
    names = list(waiting)
    if names:
        notes = [Note(f"{name} is one of them", waiting[name].at) for name in names[1:]]
        message = f"processes wait for each other: {', '.join(names)}"
        yield finding("TF812", message, waiting[names[0]].at, notes=notes, help="remove one after")


@rule("TF815", idle=True)
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


@rule("TF818")
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


@rule("TF847")
def needed_but_optional(robot: Robot) -> Iterator[Finding]:
    """A process that the robot needs waits for one with ``required: false``.

    When the optional one fails, the other is never started, and that ends everything: then it is not optional at all.
    Say ``required: false`` at both, or at neither.
    """
    optional = {process.name: process for process in robot.processes if process.required is False}
    for process in robot.processes:
        if process.required is False or process.kind == "external":
            continue
        for name, what in process.after.items():
            if name in optional:
                message = f"{process.name} waits until {name} is {what}, and {name} is optional"
                advice = f"required: false at {process.name} too, or leave it out at {name}"
                notes = [Note(f"{name} is not required here", optional[name].at)]
                yield finding("TF847", message, process.at, notes=notes, help=advice)


@rule("TF848")
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
