"""What the plan says of processes that drive sensors, or publish more than is theirs: frames, and switches."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tfcompose.plan import Driven

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import MountedSensor, Process, Robot
    from tfcompose.plan import PoseKnowledge


def driven_of(process: Process, robot: Robot) -> tuple[Driven, ...]:
    """Return the sensors that the process drives, where their driver publishes anything unless it is kept from it."""
    return tuple(_driven(sensor, robot) for sensor in _sensors(process, robot))


def switches_of(process: Process, robot: Robot) -> dict[str, dict[str, Any]]:
    """Return, by node, the parameters that are written for it and decide what it publishes."""
    keys = {key for sensor in _sensors(process, robot) for key in _switch(sensor)}
    found = {}
    for node in process.ros_nodes if process.kind in {"run", "external"} else ():
        wanted = keys | {key for claim in robot.claims if claim.node == node.name for key in claim.switch}
        switches = {key: value for key, value in node.params.items() if key in wanted}
        if switches:
            found[node.name] = switches
    return found


def _sensors(process: Process, robot: Robot) -> Iterator[MountedSensor]:
    for sensor in robot.sensors:
        if sensor.driver == process.name and (sensor.driver_frames or sensor.claims):
            yield sensor


def _switch(sensor: MountedSensor) -> dict[str, Any]:
    """Return what keeps the driver from publishing anything, whether or not it is kept from it."""
    inside = sensor.switch if sensor.driver_frames else None
    return _claimed(sensor) | (inside or {})


def _claimed(sensor: MountedSensor) -> dict[str, Any]:
    return {key: value for off in sensor.claims.values() for key, value in off.items()}


def _driven(sensor: MountedSensor, robot: Robot) -> Driven:
    switch = _claimed(sensor) if sensor.publishes else _switch(sensor)
    inside = (edge for edge in robot.edges if edge.sensor == sensor.name and not edge.given)
    frames: dict[str, PoseKnowledge] = {
        edge.child: "nominal" if edge.nominal else "exact" for edge in inside if edge.owner == sensor.driver
    }
    return Driven(sensor.name, sensor.preset, sensor.publishes, switch, frames)
