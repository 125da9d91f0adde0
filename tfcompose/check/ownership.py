"""Rules about who publishes an edge, how often, and what else may publish it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tfcompose.check.rule import rule
from tfcompose.findings import Finding, Note, did_you_mean, finding
from tfcompose.model import BUILT_IN

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.findings import Span
    from tfcompose.model import Edge, MountedSensor, Process, Robot


@rule("TF301")
def edge_with_two_owners(robot: Robot) -> Iterator[Finding]:
    """Two processes would publish one edge.

    tf2 takes the last writer without a word, so the frame flickers between two values. Each edge has one owner: leave
    the edge to the driver, or switch the driver off with ``tf: tfcompose``.
    """
    first: dict[tuple[str, str], Edge] = {}
    for edge in robot.edges:
        other = first.setdefault((edge.parent, edge.child), edge)
        if other.owner != edge.owner:
            message = f"the edge {edge.name} has two owners: {other.owner} and {edge.owner}"
            notes = [Note(f"{other.owner} owns it here", other.owner_at or other.at)]
            place = edge.owner_at or edge.at
            yield finding("TF301", message, place, notes=notes, help="remove one of the two, or its owner")


@rule("TF302")
def unknown_owner(robot: Robot) -> Iterator[Finding]:
    """An edge names an owner that is no process.

    An owner is a process of the plan: one under ``processes``, a sensor with a driver, or the built-in ``static`` and
    ``joints``. A process that somebody else starts is declared with ``external: true``.
    """
    names = {process.name: None for process in robot.processes}
    lost: dict[tuple[str, Span], list[Edge]] = {}  # a part's owner owns many edges, and is one slip
    for edge in robot.edges:
        if edge.owner not in names and not robot.excuses(edge.owner):
            lost.setdefault((edge.owner, edge.owner_at or edge.at), []).append(edge)
    for (owner, at), edges in lost.items():
        more = f" and {len(edges) - 1} more edges" if edges[1:] else ""
        advice = did_you_mean(owner, names, f"processes: {{{owner}: {{external: true}}}}")
        yield finding("TF302", f"the owner of {edges[0].name}{more} is {owner}, which is no process", at, help=advice)


@rule("TF303")
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


@rule("TF305")
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


@rule("TF306")
def one_node_two_levels(robot: Robot) -> Iterator[Finding]:
    """One node publishes both map → odom and odom → base_link.

    REP-105 keeps the two apart: odometry is continuous and drifts, localisation corrects it in jumps. A node that
    computes one pose and splits it gives an odometry that jumps too, and controllers see it; with robot_localization it
    means that one filter is set to both. Run two, ``world_frame: odom`` and ``world_frame: map``. Drivers of sensors
    that do both by themselves (visual odometry inside a camera) and stand-ins are left alone.
    """
    sensors = {sensor.driver for sensor in robot.sensors}
    owners = {p.name: p for p in robot.processes if p.kind in {"run", "external"} and p.name not in sensors}
    upper = {edge.child: edge for edge in robot.edges if _is_edge(edge, "map", {"odom"})}
    for edge in robot.edges:
        if _is_edge(edge, "odom", {"base_link", "base_footprint"}) and edge.owner in owners:
            other = upper.get(edge.parent)
            if other and other.owner == edge.owner:
                message = f"{edge.owner} publishes both {other.name} and {edge.name}"
                notes = [Note(f"{other.name} stands here", other.owner_at or other.at)]
                advice = "one process for localisation, another for odometry"
                yield finding("TF306", message, edge.owner_at or edge.at, help=advice, notes=notes)


def _is_edge(edge: Edge, parent: str, children: set[str]) -> bool:
    return edge.parent.rpartition("/")[2] == parent and edge.child.rpartition("/")[2] in children


#: Least rates in Hz of the edges that navigation looks up for every scan and every control step.
_LEAST_HZ = {
    ("odom", "base_link"): 20.0,
    ("odom", "base_footprint"): 20.0,
    ("map", "odom"): 5.0,
}


@rule("TF307")
def rate_too_low(robot: Robot) -> Iterator[Finding]:
    """Odometry comes with less than 20 Hz, or map → odom with less than 5 Hz.

    Between two messages tf2 interpolates, and after the last one it refuses: scans are dropped with "extrapolation into
    the future", and controllers act on an old pose. Raise the rate of the node that publishes the edge
    (``publish_rate``, ``frequency``, ``transform_publish_period``) and then the one declared here. Stand-ins are left
    alone.
    """
    simulated = {process.name for process in robot.processes if process.kind == "simulate"}
    for edge in robot.edges:
        ends = (edge.parent.rpartition("/")[2], edge.child.rpartition("/")[2])
        least = _LEAST_HZ.get(ends)
        if least and edge.rate is not None and edge.rate < least and edge.kind != "static":
            if edge.owner in simulated:
                continue
            message = f"{edge.name} comes with {edge.rate:g} Hz, and should with {least:g} Hz or more"
            advice = f"raise the rate of {edge.owner}, and then the one that is declared here"
            yield finding("TF307", message, edge.rate_at or edge.at, help=advice)


@rule("TF308")
def driver_publishes_too(robot: Robot) -> Iterator[Finding]:
    """A sensor's driver publishes frames by default that tfcompose owns, and tfcompose cannot switch it off.

    With ``tf: tfcompose`` the frames inside a sensor are published by tfcompose, and a driver that tfcompose starts is
    told to keep quiet. One that somebody else starts, or that is started by a command of its own, is not told: both
    would publish, and tf2 takes the last writer. Set the driver's switch where it is started, and allow this finding
    there; or leave the frames to it with ``tf: driver``. The same holds for edges outside the sensor that a driver
    sends by default, such as map → laser by sick_scan_xd.
    """
    processes = {process.name: process for process in robot.processes}
    for sensor in robot.sensors:
        process = processes.get(sensor.driver)
        if process is None:
            continue
        if (
            sensor.driver_frames
            and not sensor.publishes
            and sensor.switch
            and not _is_switched_off(process, sensor.switch)
        ):
            count, first = len(sensor.driver_frames), sensor.driver_frames[0]
            what = f"{first} and {count - 1} more" if count > 1 else first
            message = f"{process.name} publishes {what} by default, which tfcompose owns (tf: tfcompose)"
            yield _publishes_too(sensor, process, message, sensor.switch, "; or leave the frames to it: tf: driver")
        for edge, off in sensor.claims.items():
            if not _is_switched_off(process, off):
                message = f"{process.name} publishes {edge} by default, and does not own it"
                yield _publishes_too(sensor, process, message, off, "")


def _is_switched_off(process: Process, switch: dict[str, Any]) -> bool:
    """Whether the plan tells the process, or starts nothing that could publish."""
    words = " ".join(process.argv).lower()
    return process.kind not in {"run", "external"} or (
        process.kind == "run"
        and all(
            (process.package and process.params.get(key) == value) or f"{key}:={value}".lower() in words
            for key, value in switch.items()
        )
    )


def _publishes_too(sensor: MountedSensor, process: Process, message: str, off: dict[str, Any], instead: str) -> Finding:
    switch = ", ".join(f"{key}: {str(value).lower()}" for key, value in off.items())
    advice = f"start {process.name} with the parameter {switch}{instead}"
    notes = [Note(f"{process.name} is declared here", process.at)] if process.at != sensor.at else []
    return finding("TF308", message, sensor.tf_at or sensor.at, help=advice, notes=notes)


_MOST_STATIC_PUBLISHERS = 50


@rule("TF309")
def many_static_publishers(robot: Robot) -> Iterator[Finding]:
    """More than 50 processes publish fixed edges.

    Every listener keeps the last 100 messages on /tf_static and gets one from each publisher when it joins: from about
    100 publishers on edges are lost, now these and now those (geometry2#398), and each publisher costs a process and
    its discovery. Let tfcompose publish fixed edges, all in one message: leave ``owner`` out, and ``tf: tfcompose`` at
    sensors.
    """
    first = {edge.owner: edge for edge in reversed(robot.edges) if edge.kind == "static"}
    if len(first) > _MOST_STATIC_PUBLISHERS:
        listed = sorted(first)
        message = f"{len(first)} processes publish fixed edges: {', '.join(listed[:3])}, …"
        last = max(first.values(), key=lambda edge: (edge.at.line, edge.at.column))
        advice = "let tfcompose publish them: leave owner out, and tf: tfcompose at sensors"
        yield finding("TF309", message, last.owner_at or last.at, help=advice)


@rule("TF310")
def switched_edge_without_owner(robot: Robot) -> Iterator[Finding]:
    """An edge has several parents and nobody who changes between them.

    With ``parent: [tool0, rack_1]`` a tool hangs now on the arm and now in its rack. Who knows which is a process of
    yours, and it publishes the edge: ``owner: tool_changer``. What tfcompose publishes stays on one parent.
    """
    for edge in robot.edges:
        if edge.switched and edge.owner in BUILT_IN:
            message = f"{edge.child} hangs on {edge.parent} or {' or '.join(edge.switched)}, and {edge.owner} owns it"
            advice = "name the process that publishes it, owner: …, or keep one parent"
            yield finding("TF310", message, edge.at, help=advice)


@rule("TF311")
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


_STOCK = "robot_state_publisher"
_STOCK_HZ = 20.0


@rule("TF314")
def publish_frequency_too_low(robot: Robot) -> Iterator[Finding]:
    """Joint states are left out, because they come more often than they are published.

    ``publish_frequency`` is the most that tfcompose's ``joints`` and the stock robot_state_publisher publish of joint
    states with the same names; more is left out, by the stock one in silence. ``joints`` publishes all where it is left
    out, the stock one 20 Hz; and that one counts in whole milliseconds, so that give it twice what is needed. A joint
    should come as often as its edge says, or as a stand-in sends joint states.
    """
    for process in robot.processes:
        most = _most_hz(process)
        if most is None:
            continue
        wanted = [(edge.rate or 0.0, f"{edge.name} should come with", edge.rate_at or edge.at) for edge in robot.edges
                  if edge.joint and edge.owner == process.name]  # fmt: skip
        if wanted:
            wanted += [
                (one.simulate.rate, f"what {one.name} sends comes with", one.at)
                for one in robot.processes
                if one.simulate and one.simulate.kind == "joints"
            ]
        rate, what, at = max(wanted, default=(0.0, "", process.at), key=lambda each: each[0])
        if rate > most:
            message = f"{process.name} publishes at most {most:g} Hz of joint states, and {what} {rate:g} Hz"
            advice = f"params: {{publish_frequency: {2 * rate:g}}} at {process.name}"
            if process.package is None:
                advice = f"leave publish_frequency of {process.name} out, and every joint state is published"
            notes = (Note(f"{process.name} is here", process.at),) if at != process.at else ()
            yield finding("TF314", message, at, notes=notes, help=advice)


def _most_hz(process: Process) -> float | None:
    """Return the most that the process publishes of joint states, in Hz; None: all, or it publishes none."""
    stock = process.package == _STOCK
    most = process.params.get("publish_frequency", _STOCK_HZ if stock else None)
    ignores = process.params.get("ignore_timestamp") is True
    if (not stock and process.kind != "joints") or ignores or isinstance(most, bool):
        return None
    return float(most) if isinstance(most, (int, float)) and most > 0 else None


_PARAMETERS = "ros__parameters"


@rule("TF334")
def parameters_of_another_node(robot: Robot) -> Iterator[Finding]:
    """Parameters are for a node that the process does not have.

    ROS gives a node the parameters that stand under its full name, and drops all others without a word. In a parameter
    file a name without a leading slash is below the process's namespace; * is one part of a name and ** any number
    of them. Inline parameters stand without the node's name and ``ros__parameters``, because tfcompose writes these.
    """
    for process in robot.processes:
        for node in process.nodes:
            for key, value in node.params.items():
                if key == _PARAMETERS or (isinstance(value, dict) and _PARAMETERS in value):
                    message = f"the parameters of {process.name} stand under {key}, and the node would not get them"
                    yield finding("TF334", message, node.at, help="params: {NAME: VALUE, …}, or params: {file: …}")


_TRUE = frozenset({"true", "yes", "on", "y"})


@rule("TF335")
def clocks_mixed(robot: Robot) -> Iterator[Finding]:
    """A node is told another clock than the robot has.

    Transforms are found by their stamps. Where one node stamps with the wall clock and another with /clock, every
    look-up fails, or finds what is decades old. Say it once for all, ros: {clock: sim}, and tfcompose tells each node.
    """
    sim = robot.ros.clock == "sim"
    for process in robot.processes:
        for node in process.nodes:
            said = node.params.get("use_sim_time")
            if said is None or (str(said).lower() in _TRUE) == sim:
                continue
            message = f"{node.name} has use_sim_time: {str(said).lower()}, and the robot's clock is {robot.ros.clock}"
            yield finding("TF335", message, node.at, help=f"remove it, or ros: {{clock: {'wall' if sim else 'sim'}}}")
