"""Rules about edges: their owner, their rate, and other nodes that may publish them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tfcompose.compiler.check.rule import rule
from tfcompose.foundation.findings import Finding, Note, did_you_mean, finding
from tfcompose.foundation.text import with_more
from tfcompose.model.robot import BUILT_IN, advise_left_out

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.foundation.findings import Span
    from tfcompose.model.robot import Edge, MountedSensor, Process, Robot


@rule("TF301")
def edge_with_two_owners(robot: Robot) -> Iterator[Finding]:
    first: dict[tuple[str, str], Edge] = {}
    for edge in robot.edges:
        first_edge = first.setdefault((edge.parent, edge.child), edge)
        if first_edge.owner != edge.owner:
            message = f"edge {edge.name} has two owners: {first_edge.owner} and {edge.owner}"
            notes = [
                Note(f"{first_edge.owner} owns it here", first_edge.owner_at or first_edge.span)
            ]
            span = edge.owner_at or edge.span
            yield finding(
                "TF301",
                message,
                span,
                notes=notes,
                help="remove one of the two edges, or its owner",
            )


#: Stock ROS programs that tfcompose replaces.
STOCK = frozenset({"robot_state_publisher", "static_transform_publisher", "joint_state_publisher"})


@rule("TF302")
def unknown_owner(robot: Robot) -> Iterator[Finding]:
    names = {process.name: None for process in robot.processes}
    lost: dict[
        tuple[str, Span], list[Edge]
    ] = {}  # report an owner once: a part's owner may own many edges
    for edge in robot.edges:
        if edge.owner not in names and not robot.tolerates(edge.owner):
            lost.setdefault((edge.owner, edge.owner_at or edge.span), []).append(edge)
    for (owner, span), edges in lost.items():
        declare = (
            f"declare it: processes: {{{owner}: {{external: true}}}}, if it is started elsewhere"
        )
        message = f"unknown owner {owner} of {with_more(edges[0].name, len(edges) - 1)}"
        runs = next(
            (
                p.name
                for p in robot.processes
                if owner in {node.rpartition("/")[2] for node in p.nodes}
            ),
            "",
        )
        declare = f"did you mean {runs}, the process that runs this node?" if runs else declare
        if owner in STOCK:
            declare = "leave owner out: tfcompose publishes fixed frames and joints itself"
        advice = advise_left_out(robot.conditions, owner) or did_you_mean(owner, names, declare)
        yield finding("TF302", message, span, help=advice)


@rule("TF303")
def owner_cannot_publish(robot: Robot) -> Iterator[Finding]:
    processes = {process.name: process for process in robot.processes}
    for edge in robot.edges:
        process = processes.get(edge.owner)
        if process is None or (edge.free and edge.owner in BUILT_IN):  # TF715 reports it
            continue
        reason = ""
        if process.kind == "guard":
            reason = "the guard publishes nothing"
        elif process.kind == "joints" and not edge.joint:
            reason = "joints publishes only moving joints"
        elif process.kind == "static" and edge.joint:
            reason = "static publishes only fixed edges"
        elif process.simulate and process.simulate.kind == "joints":
            reason = f"{process.name} sends joint states, not edges"
        if reason:
            message = f"{edge.owner} cannot publish {edge.name}: {reason}"
            advice = "remove owner, or name the process that publishes the edge"
            yield finding("TF303", message, edge.owner_at or edge.span, help=advice)


@rule("TF305")
def static_edge_with_rate(robot: Robot) -> Iterator[Finding]:
    for edge in robot.edges:
        refused = robot.tolerates(edge.owner) or robot.tolerates(
            edge.child
        )  # the owner may have been rejected
        if edge.kind == "static" and edge.rate is not None and not refused:
            message = (
                f"{edge.name} is fixed, and sent once: the rate of {edge.rate:g} Hz has no meaning"
            )
            advice = (
                "remove rate"
                if edge.owner_at
                else "remove rate, or add the owner that publishes the edge"
            )
            yield finding("TF305", message, edge.rate_at or edge.span, help=advice)


@rule("TF306")
def one_node_two_levels(robot: Robot) -> Iterator[Finding]:
    sensors = {sensor.driver for sensor in robot.sensors}
    owners = {
        p.name: p
        for p in robot.processes
        if p.kind in {"run", "external"} and p.name not in sensors
    }
    upper = {edge.child: edge for edge in robot.edges if _is_edge(edge, "map", {"odom"})}
    for edge in robot.edges:
        if _is_edge(edge, "odom", {"base_link", "base_footprint"}) and edge.owner in owners:
            upper_edge = upper.get(edge.parent)
            if upper_edge and upper_edge.owner == edge.owner:
                message = f"{edge.owner} publishes both {upper_edge.name} and {edge.name}"
                notes = [
                    Note(
                        f"{upper_edge.name} is defined here",
                        upper_edge.owner_at or upper_edge.span,
                    )
                ]
                advice = "use one process for localisation and another for odometry"
                yield finding(
                    "TF306", message, edge.owner_at or edge.span, help=advice, notes=notes
                )


@rule("TF336")
def slower_than_declared(robot: Robot) -> Iterator[Finding]:
    simulated = {process.name: process for process in robot.processes if process.simulate}
    for edge in robot.edges:
        process = simulated.get(edge.owner)
        if process is None or process.simulate is None or edge.rate is None:
            continue
        rate = process.simulate.rate
        if edge.is_slower(rate):
            message = f"{process.name} is simulated at {rate:g} Hz, but {edge.name} is declared"
            message += f" with {edge.rate:g} Hz"
            notes = [Note("declared here", edge.rate_at or edge.span)]
            advice = "remove rate under simulate: the declared rate is its default"
            yield finding("TF336", message, process.span, help=advice, notes=notes)


def _is_edge(edge: Edge, parent: str, children: set[str]) -> bool:
    return edge.parent.rpartition("/")[2] == parent and edge.child.rpartition("/")[2] in children


#: Minimum rates, in Hz, of edges that navigation looks up for each scan and each control step.
_LEAST_HZ = {
    ("odom", "base_link"): 20.0,
    ("odom", "base_footprint"): 20.0,
    ("map", "odom"): 5.0,
}


@rule("TF307")
def rate_too_low(robot: Robot) -> Iterator[Finding]:
    simulated = {process.name for process in robot.processes if process.kind == "simulate"}
    for edge in robot.edges:
        ends = (edge.parent.rpartition("/")[2], edge.child.rpartition("/")[2])
        least = _LEAST_HZ.get(ends)
        if least and edge.rate is not None and edge.rate < least and edge.kind != "static":
            if edge.owner in simulated:
                continue
            message = f"{edge.name} has a rate of {edge.rate:g} Hz; it needs at least {least:g} Hz"
            advice = f"raise the rate of {edge.owner}, then the one declared here"
            yield finding("TF307", message, edge.rate_at or edge.span, help=advice)


@rule("TF308")
def driver_publishes_too(robot: Robot) -> Iterator[Finding]:
    processes = {process.name: process for process in robot.processes}
    for sensor in robot.sensors:
        process = processes.get(sensor.driver)
        if process is None:
            continue
        if (
            sensor.driver_frames
            and not sensor.publishes
            and sensor.switch
            and (sensor.by_default or _is_switched_on(process, sensor.switch))
            and not _is_switched_off(process, sensor.switch)
        ):
            count, first = len(sensor.driver_frames), sensor.driver_frames[0]
            what = f"{first} and {count - 1} more" if count > 1 else first
            message = (
                f"{process.name} publishes {what} by default, which tfcompose owns (tf: tfcompose)"
            )
            yield _publishes_too(
                sensor, process, message, sensor.switch, ", or leave the frames to it: tf: driver"
            )
        for edge, off in sensor.claims.items():
            if not _is_switched_off(process, off):
                message = f"{process.name} publishes {edge} by default but does not own it"
                yield _publishes_too(sensor, process, message, off, "")


def _is_switched_off(process: Process, switch: dict[str, Any]) -> bool:
    """Return whether the plan disables the driver's TF output, or starts no driver."""
    command_line = " ".join(process.argv).lower()
    return process.kind not in {"run", "external"} or (
        process.kind == "run"
        and all(
            (process.package and process.params.get(key) == value)
            or f"{key}:={value}".lower() in command_line
            for key, value in switch.items()
        )
    )


def _is_switched_on(process: Process, switch: dict[str, Any]) -> bool:
    """Return whether a parameter or argument sets the switch to another value than ``switch``."""
    command_line = " ".join(process.argv).lower()
    differs = [
        process.params[key] != value for key, value in switch.items() if key in process.params
    ]
    return any(differs) or any(
        f"{key}:=" in command_line and f"{key}:={value}".lower() not in command_line
        for key, value in switch.items()
    )


def _publishes_too(
    sensor: MountedSensor, process: Process, message: str, off: dict[str, Any], instead: str
) -> Finding:
    switch = ", ".join(f"{key}: {str(value).lower()}" for key, value in off.items())
    advice = f"start {process.name} with the parameter {switch}{instead}"
    notes = (
        [Note(f"{process.name} is declared here", process.span)]
        if process.span != sensor.span
        else []
    )
    return finding("TF308", message, sensor.tf_at or sensor.span, help=advice, notes=notes)


_MOST_STATIC_PUBLISHERS = 50


@rule("TF309")
def many_static_publishers(robot: Robot) -> Iterator[Finding]:
    first = {edge.owner: edge for edge in reversed(robot.edges) if edge.kind == "static"}
    if len(first) > _MOST_STATIC_PUBLISHERS:
        listed = sorted(first)
        message = f"{len(first)} processes publish fixed edges: {', '.join(listed[:3])}, …"
        last = max(first.values(), key=lambda edge: (edge.span.line, edge.span.column))
        advice = "let tfcompose publish them: remove owner, and set tf: tfcompose on sensors"
        yield finding("TF309", message, last.owner_at or last.span, help=advice)


@rule("TF310")
def switched_edge_without_owner(robot: Robot) -> Iterator[Finding]:
    for edge in robot.edges:
        if edge.switched and edge.owner in BUILT_IN:
            parents = " or ".join((edge.parent, *edge.switched))
            message = (
                f"the parent of {edge.child} is {parents}, and {edge.owner} cannot switch between"
                " them"
            )
            advice = "name the process that publishes the edge, owner: …, or keep one parent"
            yield finding("TF310", message, edge.span, help=advice)


@rule("TF311")
def switched_edge_static(robot: Robot) -> Iterator[Finding]:
    for edge in robot.edges:
        if edge.switched and edge.kind == "static" and edge.owner not in BUILT_IN:
            parents = ", ".join((edge.parent, *edge.switched))
            message = (
                f"{edge.owner} publishes {edge.child} on /tf_static while its parent changes:"
                f" {parents}"
            )
            yield finding(
                "TF311",
                message,
                edge.span,
                help="publish it on /tf: give it a rate, and remove static: true",
            )


_STOCK = "robot_state_publisher"
_STOCK_HZ = 20.0


@rule("TF314")
def publish_frequency_too_low(robot: Robot) -> Iterator[Finding]:
    for process in robot.processes:
        most = _most_hz(process)
        if most is None:
            continue
        rates = [
            (edge.rate or 0.0, f"{edge.name} needs", edge.rate_at or edge.span)
            for edge in robot.edges
            if edge.joint and edge.owner == process.name
        ]
        if rates:
            rates += [
                (process.simulate.rate, f"{process.name} sends", process.span)
                for process in robot.processes
                if process.simulate and process.simulate.kind == "joints"
            ]
        rate, what, span = max(rates, default=(0.0, "", process.span), key=lambda each: each[0])
        if rate > most:
            message = (
                f"{process.name} publishes joint states with at most {most:g} Hz, but {what}"
                f" {rate:g} Hz"
            )
            advice = f"set params: {{publish_frequency: {2 * rate:g}}} on {process.name}"
            if process.package is None:
                advice = (
                    f"remove publish_frequency from {process.name}: then it publishes every joint"
                    " state"
                )
            notes = (
                (Note(f"{process.name} is defined here", process.span),)
                if span != process.span
                else ()
            )
            yield finding("TF314", message, span, notes=notes, help=advice)


def _most_hz(process: Process) -> float | None:
    """Return the maximum rate in Hz at which the process publishes joint states.

    None if the process has no maximum rate or publishes no joint states.
    """
    stock = process.package == _STOCK
    most = process.params.get("publish_frequency", _STOCK_HZ if stock else None)
    ignores = process.params.get("ignore_timestamp") is True
    if (not stock and process.kind != "joints") or ignores or isinstance(most, bool):
        return None
    return float(most) if isinstance(most, (int, float)) and most > 0 else None


_PARAMETERS = "ros__parameters"


@rule("TF334")
def parameters_of_another_node(robot: Robot) -> Iterator[Finding]:
    for process in robot.processes:
        for node in process.ros_nodes:
            for key, value in node.params.items():
                if key == _PARAMETERS or (isinstance(value, dict) and _PARAMETERS in value):
                    message = f"the node of {process.name} does not get the parameters under {key}"
                    advice = (
                        "write params: {NAME: VALUE, …} without the node's name, or params:"
                        " {file: …}"
                    )
                    yield finding("TF334", message, node.span, help=advice)


_TRUE = frozenset({"true", "yes", "on", "y"})


@rule("TF335")
def clocks_mixed(robot: Robot) -> Iterator[Finding]:
    sim = robot.ros.clock == "sim"
    for process in robot.processes:
        for node in process.ros_nodes:
            value = node.params.get("use_sim_time")
            if value is None or (str(value).lower() in _TRUE) == sim:
                continue
            message = (
                f"{node.name} has use_sim_time: {str(value).lower()}, but the robot's clock is"
                f" {robot.ros.clock}"
            )
            place, *inside = node.places.get("use_sim_time", (node.span,))
            notes = [Note("it is set here", span) for span in inside]
            way_out = f"write use_sim_time: {str(sim).lower()} beside file: it takes precedence"
            way_out = way_out if inside else "remove use_sim_time"
            advice = f"{way_out}; or set ros: {{clock: {'wall' if sim else 'sim'}}}"
            yield finding("TF335", message, place, help=advice, notes=notes)
