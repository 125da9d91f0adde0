"""A robot with the names that it has as a part of another robot."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from tfcompose.model.plan import EdgePattern
from tfcompose.model.robot import BUILT_IN

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model.plan import GuardPolicy
    from tfcompose.model.robot import (
        Calibration,
        Edge,
        Joint,
        Link,
        MountedSensor,
        Part,
        Process,
        Robot,
        Shape,
        SourceNumbers,
        Zone,
    )
    from tfcompose.model.robot.hardware import Block, Hardware


@dataclass(frozen=True, slots=True)
class Names:
    """New names of a part's entries in the including robot."""

    #: The part's name, which is prepended to the names of processes and sensors.
    part: str
    #: Prefix of the names of frames and joints.
    prefix: str
    #: Frames that keep their names.
    shared: frozenset[str]
    #: Whether the part has its own ``static`` and ``joints``. Otherwise these processes of the
    #: including robot publish the part's edges.
    alone: bool

    def frame(self, name: str) -> str:
        """Return the new name of a frame."""
        return name if name in self.shared else f"{self.prefix}{name}"

    def joint(self, name: str) -> str:
        """Return the new name of a joint; empty for an empty name."""
        return f"{self.prefix}{name}" if name else name

    def process(self, name: str) -> str:
        """Return the new name of a process or sensor."""
        return name if name in BUILT_IN and not self.alone else f"{self.part}/{name}"


def rename_robot(robot: Robot, names: Names) -> Robot:
    """Return the robot with its names as a part."""
    again = _again(robot, names) if robot.hardware else {}
    kept = [process for process in robot.processes if process.name not in BUILT_IN or names.alone]
    broken = {
        (section, again)
        for section, name in robot.broken
        for again in _names_of(section, name, names)
    }
    return replace(
        robot,
        frames={names.frame(name): span for name, span in robot.frames.items()},
        edges=tuple(_edge(edge, names) for edge in robot.edges),
        links={names.frame(name): _link(link, names) for name, link in robot.links.items()},
        processes=tuple(_process(process, names) for process in kept if process.kind != "guard"),
        base=robot.base and names.frame(robot.base),
        ground=robot.ground and names.frame(robot.ground),
        guard=_policy(robot.guard, robot, names),
        sensors=tuple(_sensor(sensor, names) for sensor in robot.sensors),
        claims=tuple(
            replace(c, parent=names.frame(c.parent), child=names.frame(c.child))
            for c in robot.claims
        ),
        broken=frozenset(broken),
        parts=tuple(_part(part, names) for part in robot.parts),
        hardware=tuple(_hardware(hardware, names, again) for hardware in robot.hardware),
        blocks=tuple(_blocks(robot, names)),
        zones=tuple(_zone(zone, robot, names) for zone in robot.zones),
        source_numbers=tuple(_numbers(number, names) for number in robot.source_numbers),
    )


def _numbers(numbers: SourceNumbers, names: Names) -> SourceNumbers:
    section = numbers.path[0]
    again = names.process if section in {"sensors", "parts", "processes"} else names.frame
    return replace(
        numbers, in_part=names.joint(numbers.name) if section == "joints" else again(numbers.name)
    )


def _link(link: Link, names: Names) -> Link:
    visuals = (
        tuple(_shape(shape, names) for shape in link.visuals) if names.prefix else link.visuals
    )
    return replace(link, name=names.frame(link.name), visuals=visuals)


def _shape(shape: Shape, names: Names) -> Shape:
    """Return the shape with a new name for its material.

    In URDF, the name of a material applies to the entire robot. A material that is named after its
    colour keeps its name.
    """
    material = shape.material
    if material is None or material.name.startswith("rgba"):
        return shape
    return replace(shape, material=replace(material, name=names.prefix + material.name))


def _edge(edge: Edge, names: Names) -> Edge:
    return replace(
        edge,
        parent=names.frame(edge.parent),
        child=names.frame(edge.child),
        owner=names.process(edge.owner),
        joint=_joint(edge.joint, names) if edge.joint else None,
        free=_joint(edge.free, names) if edge.free else None,
        joint_name=names.joint(edge.joint_name),
        sensor=names.process(edge.sensor) if edge.sensor else None,
        calibration=_calibration(edge.calibration, names) if edge.calibration else None,
        switched=tuple(map(names.frame, edge.switched)),
    )


def _joint(joint: Joint, names: Names) -> Joint:
    return replace(
        joint,
        name=names.joint(joint.name),
        mimic=names.joint(joint.mimic) if joint.mimic else None,
    )


def _hardware(hardware: Hardware, names: Names, again: dict[str, str]) -> Hardware:
    """Return the hardware, with sensors and gpios under names that no other part has."""
    inside = (
        replace(
            component, name=names.joint(component.name), params=_params(component.params, again)
        )
        for component in hardware.components
    )
    params = _params(hardware.params, again)
    return replace(
        hardware, name=names.joint(hardware.name), params=params, components=tuple(inside)
    )


def _params(params: dict[str, str], again: dict[str, str]) -> dict[str, str]:
    """Return the parameters. Values that name a frame or a joint get the new name."""
    return {key: again.get(value, value) for key, value in params.items()}


def _again(robot: Robot, names: Names) -> dict[str, str]:
    """Return the new names of frames and joints by their old names."""
    again = {frame: names.frame(frame) for frame in robot.frames}
    return again | {
        edge.joint_name: names.joint(edge.joint_name) for edge in robot.edges if edge.joint_name
    }


def _blocks(robot: Robot, names: Names) -> Iterator[Block]:
    again = {
        name: names.joint(name) for block in robot.blocks for name in block.own_names()
    } | _again(robot, names)
    for block in robot.blocks:
        yield replace(block.rename(again), name=f"{names.part}/{block.name}")


def _calibration(calibration: Calibration, names: Names) -> Calibration:
    return replace(
        calibration, parent=names.frame(calibration.parent), child=names.frame(calibration.child)
    )


def _process(process: Process, names: Names) -> Process:
    simulate, component = process.simulate, process.component
    if simulate and not (names.alone or process.part):  # joint states use the new names of joints
        joints = {names.joint(name): q for name, q in simulate.joints.items()}
        sweep = {names.joint(name): how for name, how in simulate.sweep.items()}
        simulate = replace(simulate, joints=joints, sweep=sweep)
    return replace(
        process,
        name=names.process(process.name),
        after={names.process(name): what for name, what in process.after.items()},
        simulate=simulate,
        component=component and replace(component, container=names.process(component.container)),
        part=f"{names.part}/{process.part}".rstrip("/") if names.alone or process.part else "",
    )


def _part(part: Part, names: Names) -> Part:
    return replace(part, name=f"{names.part}/{part.name}", prefix=f"{names.prefix}{part.prefix}")


def _sensor(sensor: MountedSensor, names: Names) -> MountedSensor:
    return replace(
        sensor,
        name=names.process(sensor.name),
        mount=names.frame(sensor.mount),
        frames=tuple(map(names.frame, sensor.frames)),
        driver_frames=tuple(map(names.frame, sensor.driver_frames)),
        driver=names.process(sensor.driver) if sensor.driver else "",
        optics=tuple(replace(stream, frame=names.frame(stream.frame)) for stream in sensor.optics),
    )


def _zone(zone: Zone, robot: Robot, names: Names) -> Zone:
    sensors = {sensor.name for sensor in robot.sensors}
    renamed = {name: names.process(name) for name in sensors}
    by = tuple(renamed.get(name, name) for name in zone.by)
    return replace(zone, name=f"{names.part}/{zone.name}", frame=names.frame(zone.frame), by=by)


def _policy(policy: GuardPolicy, robot: Robot, names: Names) -> GuardPolicy:
    """Return the policy with new names in patterns that name a frame.

    Other patterns do not change.
    """

    def final(pattern: str) -> str:
        return names.frame(pattern) if pattern in robot.frames else pattern

    return replace(
        policy,
        allow=tuple(
            EdgePattern(final(pattern.parent), final(pattern.child)) for pattern in policy.allow
        ),
    )


def _names_of(section: str, name: str, names: Names) -> tuple[str, ...]:
    """Return the possible new names of a frame or process of a rejected entry."""
    has_process = section in {"sensors", "containers", "processes"}
    return (names.frame(name), names.process(name)) if has_process else (names.frame(name),)
