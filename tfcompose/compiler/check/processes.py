"""Rules about processes: start conditions that cannot be met, and processes without a role."""

from __future__ import annotations

import re
from contextlib import suppress
from graphlib import CycleError, TopologicalSorter
from typing import TYPE_CHECKING

from tfcompose.compiler.check.rule import rule
from tfcompose.foundation.findings import Finding, Note, did_you_mean, finding
from tfcompose.foundation.units import UNITS
from tfcompose.model.robot import advise_left_out

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model.robot import Robot


@rule("TF812")
def start_order_loop(robot: Robot) -> Iterator[Finding]:
    waiting = {process.name: process for process in robot.processes}
    order = TopologicalSorter(
        {name: waiting.keys() & process.after.keys() for name, process in waiting.items()}
    )
    with suppress(CycleError):
        order.prepare()
    while order.is_active():
        free = order.get_ready()
        order.done(*free)
        for name in free:
            del waiting[name]
    names = list(waiting)
    if names:
        notes = [Note(f"{name} is defined here", waiting[name].span) for name in names[1:]]
        message = f"processes wait for each other: {', '.join(names)}"
        yield finding(
            "TF812",
            message,
            waiting[names[0]].span,
            notes=notes,
            help="remove one of their after entries",
        )


def _needed_processes(robot: Robot) -> set[str]:
    """Return the processes that the tree needs, and those that another process waits for.

    The tree needs a process that owns an edge, drives a sensor, or publishes TF by default.
    """
    publishers = {claim.node for claim in robot.claims}
    return (
        {edge.owner for edge in robot.edges}
        | {sensor.driver for sensor in robot.sensors}
        | {name for process in robot.processes for name in process.after}
        | {process.name for process in robot.processes if not publishers.isdisjoint(process.nodes)}
    )


@rule("TF815", idle=True)
def process_without_role(robot: Robot) -> Iterator[Finding]:
    owners = {edge.owner for edge in robot.edges} | {sensor.driver for sensor in robot.sensors}
    needed = _needed_processes(robot)
    if owners - {process.name for process in robot.processes} - {""}:
        return  # a name is misspelt, which TF302 reports
    moving = any(edge.joint for edge in robot.edges)
    states = any(
        process.simulate and process.simulate.kind == "joints" for process in robot.processes
    )
    for process in robot.processes:
        if (
            process.kind not in {"external", "simulate"}
            or process.name in needed
            or process.loads
            or robot.tolerates(process.name)
        ):
            continue
        if process.kind == "external" and moving and not states:
            continue
        if process.simulate and process.simulate.kind == "joints" and moving:
            continue
        reason, advice = (
            "it owns no edge",
            f"write owner: {process.name} on the edge that it publishes, or remove it",
        )
        if process.simulate and process.simulate.kind == "joints":
            reason, advice = "no joint moves", "remove it"
        yield finding(
            "TF815", f"unused process {process.name}: {reason}", process.span, help=advice
        )


@rule("TF818")
def required_without_role(robot: Robot) -> Iterator[Finding]:
    needed = _needed_processes(robot)
    for process in robot.processes:
        if process.required and process.name not in needed and not robot.tolerates(process.name):
            message = f"{process.name} is required, but owns no edge, and nothing waits for it"
            advice = (
                f"remove required, or write after: {{{process.name}: ready}} on the process that"
                " needs it"
            )
            yield finding("TF818", message, process.span, help=advice)


@rule("TF847")
def needed_but_optional(robot: Robot) -> Iterator[Finding]:
    optional = {process.name: process for process in robot.processes if process.required is False}
    for process in robot.processes:
        if process.required is False or process.kind == "external":
            continue
        for name, what in process.after.items():
            if name in optional:
                message = f"{process.name} waits until {name} is {what}, but {name} is optional"
                advice = f"write required: false on {process.name} too, or remove it from {name}"
                notes = [Note(f"{name} is defined here", optional[name].span)]
                yield finding("TF847", message, process.span, notes=notes, help=advice)


@rule("TF848")
def gate_never_opens(robot: Robot) -> Iterator[Finding]:
    owners = {edge.owner for edge in robot.edges}
    for process in robot.processes:
        kind = process.ready.kind if process.ready else ""
        if kind == "edges" and process.name not in owners:
            message = f"{process.name} is ready when its edges are live, but it owns none"
            yield finding(
                "TF848",
                message,
                process.span,
                help="remove ready, or wait for a topic or a line of output",
            )
        elif kind == "exit" and process.restart == "always":
            message = (
                f"{process.name} is ready when it has ended, but restart: always starts it again"
            )
            yield finding(
                "TF848", message, process.span, help="write restart: on-failure, or remove restart"
            )


@rule("TF855")
def component_elsewhere(robot: Robot) -> Iterator[Finding]:
    processes = {process.name: process for process in robot.processes}
    for process in robot.processes:
        container = processes.get(process.component.container) if process.component else None
        if container and process.host != container.host:
            message = (
                f"{process.name} is on {process.host}, but its container {container.name} is on"
                f" {container.host}"
            )
            if container.host is None:
                message = (
                    f"{process.name} is on {process.host}, and its container {container.name}"
                    " names no host"
                )
            notes = [Note(f"{container.name} is defined here", container.span)]
            yield finding(
                "TF855",
                message,
                process.span,
                notes=notes,
                help=f"remove host from {process.name}",
            )


@rule("TF856")
def container_without_components(robot: Robot) -> Iterator[Finding]:
    used = {process.component.container for process in robot.processes if process.component}
    for process in robot.processes:
        if process.loads and process.name not in used:
            advice = (
                f"processes: {{NAME: {{component: PACKAGE/CLASS, container: {process.name}}}}}, or"
                " remove it"
            )
            yield finding(
                "TF856",
                f"the container {process.name} has no components",
                process.span,
                help=advice,
            )


@rule("TF857")
def host_not_declared(robot: Robot) -> Iterator[Finding]:
    for process in robot.processes if robot.hosts else ():
        name = process.host
        if (
            name is None
            or process.host_at is None
            or name in robot.hosts
            or ("hosts", name) in robot.broken
        ):
            continue
        otherwise = (
            advise_left_out(robot.conditions, name) or f"hosts: {{{name}: {{ssh: user@address}}}}"
        )
        advice = did_you_mean(name, robot.hosts, otherwise)
        message = f"{process.name} is on {name}, which is not among hosts"
        yield finding("TF857", message, process.host_at, help=advice)


@rule("TF858", idle=True)
def host_without_processes(robot: Robot) -> Iterator[Finding]:
    used = {process.host for process in robot.processes}
    for name, host in robot.hosts.items():
        if name not in used and ("hosts", name) not in robot.broken:
            advice = (
                f"processes: {{static: {{host: {name}}}}} runs every process without a host there,"
                " or remove it"
            )
            yield finding("TF858", f"no process runs on the host {name}", host.span, help=advice)


#: A number, a space, and a possible unit.
_WITH_UNIT = re.compile(r"([-+]?[\d.]+(?:[eE][-+]?\d+)?) +(\S+)")


@rule("TF859")
def parameter_with_unit(robot: Robot) -> Iterator[Finding]:
    for process in robot.processes:
        for node in process.ros_nodes:
            for name, value in node.params.items():
                parts = _WITH_UNIT.fullmatch(value) if isinstance(value, str) else None
                if parts and parts[2] in UNITS:
                    span, *_ = node.places.get(name, (node.span,))
                    message = f"{node.name} gets the parameter {name} as a string: {value}"
                    advice = (
                        f"parameters have no units: write {name}: {parts[1]}, in the unit that the"
                        " node expects"
                    )
                    yield finding("TF859", message, span, help=advice)
