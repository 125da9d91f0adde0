"""The plan: how to start each process, and the edges that each process owns."""

from __future__ import annotations

import hashlib
import json
import posixpath
import re
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from tfcompose.compiler.emit.argv import argv_of, component_params, file_params
from tfcompose.foundation.numbers import clean
from tfcompose.model.fields import narrow
from tfcompose.model.files import AS_IN_SOURCE, Target
from tfcompose.model.plan import DESCRIPTION, Driven, Plan, PlanJoint, SourceLine
from tfcompose.model.robot import JOINTS, STATIC
from tfcompose.spec.language.overlay import SETTING

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model.plan import PlanEdge, PlanProcess, PoseKnowledge
    from tfcompose.model.robot import Edge, MountedSensor, Process, Robot

_FILE = re.compile(r"\$\{file:([^{}]*)\}")

_PUBLISHERS = frozenset({"static", "joints"})

#: Start order by kind: publishers of fixed edges and descriptions first, the guard last.
_ORDER = {"static": 0, "joints": 1, "guard": 3}


def plan_of(robot: Robot, target: Target = AS_IN_SOURCE) -> Plan:
    """Return the plan of a robot without errors; ``target`` holds the folder to write to."""
    nodes = {process.name: process.node for process in robot.processes}
    needed = _needed_processes(robot)
    names = frozenset(process.name for process in needed)
    relative = {
        file: _relative(file, robot.file) for file in {edge.span.file for edge in robot.edges}
    }
    prefixes = {f"{part.name}/{JOINTS}": part.prefix for part in robot.parts}
    edges = tuple(
        [
            _edge(
                edge,
                edge.node or nodes[edge.owner],
                relative[edge.span.file],
                prefixes.get(edge.owner, ""),
            )
            for edge in robot.edges
        ]
    )
    main = next((process.host for process in robot.processes if process.name == STATIC), None)
    owned: dict[str, list[tuple[str, str]]] = {}
    for edge in edges:
        owned.setdefault(edge.owner, []).append((edge.parent, edge.child))
    return Plan(
        robot=robot.name,
        spec_digest=_digest(robot),
        file=_relative(robot.file, robot.file),
        profiles=robot.profiles,
        overlays=tuple(_overlay(overlay, robot.file) for overlay in robot.overlays),
        base=robot.base,
        ros=robot.ros,
        edges=edges,
        processes=tuple(
            _on(
                main,
                _relocate(target, _process(process, robot, owned.get(process.name, []), names)),
            )
            for process in needed
        ),
        guard=robot.guard,
        claims=tuple(claim.to_plan() for claim in robot.claims),
        args=robot.args,
        environment=robot.environment,
        hosts={name: host.to_plan() for name, host in robot.hosts.items()},
        sections={
            name: section.planned
            for name, section in robot.sections.items()
            if section.planned is not None
        },
    )


def _needed_processes(robot: Robot) -> list[Process]:
    """Return the processes that have something to do.

    The robot, and each part that is a separate robot, gets ``joints`` if a joint moves, otherwise
    at least ``static``.
    """
    owners = {edge.owner for edge in robot.edges}
    idle = {
        process.name
        for process in robot.processes
        if process.kind in _PUBLISHERS and process.name not in owners
    }
    joint_publishers = {
        process.name for process in robot.processes if process.kind == "joints"
    } - idle
    for name in {_below(process.part, STATIC) for process in robot.processes}:
        if _below(name.removesuffix(STATIC).rstrip("/"), JOINTS) not in joint_publishers:
            idle.discard(name)
    return sorted(
        (p for p in robot.processes if p.name not in idle),
        key=lambda process: _ORDER.get(process.kind, 2),
    )


def _below(part: str, name: str) -> str:
    return f"{part}/{name}" if part else name


def _digest(robot: Robot) -> str:
    """Return the digest of the robot's source data.

    The digest changes with keys and values, but not with layout or comments.
    """
    text = json.dumps(robot.source_data, sort_keys=True, ensure_ascii=False)
    return f"sha256:{hashlib.sha256(text.encode()).hexdigest()}"


def _edge(edge: Edge, node: str, file: str, prefix: str) -> PlanEdge:
    """Return the edge as a plan's edge.

    Its joint loses ``prefix``, because joint states do not have the prefix.
    """
    moving = edge.joint
    joint = None
    if moving:
        name, mimic = (
            moving.name.removeprefix(prefix),
            moving.mimic and moving.mimic.removeprefix(prefix),
        )
        joint = narrow(PlanJoint, moving, name=name, mimic=mimic)
    return edge.to_plan(
        node=node,
        pose=clean(edge.pose),
        source=SourceLine(file, edge.span.line),
        joint=joint,
        mounts=(edge.sensor or "") if edge.declared else "",
    )


def _relative(file: str, to: str) -> str:
    """Return the path of ``file`` relative to the folder of the robot file ``to``.

    The result does not depend on the location of that folder.
    """
    return posixpath.relpath(file, posixpath.dirname(to) or ".")


def _overlay(name: str, to: str) -> str:
    """Return a ``--set`` unchanged, or an overlay's path relative to the robot file."""
    return name if name.startswith(SETTING) else _relative(name, to)


def _process(
    process: Process, robot: Robot, owned: list[tuple[str, str]], names: frozenset[str]
) -> PlanProcess:
    has_params = process.kind == "run" and bool(file_params(process))
    simulation = process.simulate
    if simulation:
        simulation = replace(simulation, pose=clean(simulation.pose))
    return process.to_plan(
        argv=argv_of(process, robot, has_params=has_params, owns=bool(owned)),
        params_file=f"params/{process.name}.yaml" if has_params else None,
        after={name: when for name, when in process.after.items() if name in names},
        owns=tuple(owned),
        simulate=simulation,
        description=(
            f"{process.part}/{DESCRIPTION}"
            if process.part and process.kind in _PUBLISHERS
            else None
        ),
        drives=driven_sensors(process, robot),
        switches=switches_of(process, robot),
        component=process.component
        and replace(process.component, params=component_params(process, robot)),
    )


def _relocate(target: Target, process: PlanProcess) -> PlanProcess:
    """Return the process with file paths relative to the plan's folder."""

    def resolve_text(text: str) -> str:
        return _FILE.sub(lambda match: f"${{build_dir}}/{target.from_folder(match[1])}", text)

    def resolve_paths(value: Any) -> Any:
        return resolve_text(value) if isinstance(value, str) else value

    env = {name: resolve_text(value) for name, value in process.env.items()}
    component = process.component
    if component:
        component = replace(
            component,
            params={name: resolve_paths(value) for name, value in component.params.items()},
        )
    cwd = process.cwd and resolve_text(process.cwd)
    return replace(
        process,
        argv=tuple(resolve_text(argument) for argument in process.argv),
        env=env,
        cwd=cwd,
        component=component,
    )


def _on(main: str | None, process: PlanProcess) -> PlanProcess:
    """Return the process with its host: by default the host of ``static``.

    The guard runs on every host.
    """
    if process.host or process.kind in ("external", "guard"):
        return process
    return replace(process, host=main)


def driven_sensors(process: Process, robot: Robot) -> tuple[Driven, ...]:
    """Return the sensors of the process whose driver publishes frames by default."""
    return tuple(_driven_sensor(sensor, robot) for sensor in _sensors(process, robot))


def switches_of(process: Process, robot: Robot) -> dict[str, dict[str, Any]]:
    """Return, by node, the parameters in the file that decide which edges the node publishes."""
    keys = {key for sensor in _sensors(process, robot) for key in _switch(sensor)}
    values = {}
    for node in process.ros_nodes if process.kind in {"run", "external", "component"} else ():
        names = keys | {
            key for claim in robot.claims if claim.node == node.name for key in claim.off
        }
        switches = {key: value for key, value in node.params.items() if key in names}
        if switches:
            values[node.name] = switches
    return values


def _sensors(process: Process, robot: Robot) -> Iterator[MountedSensor]:
    for sensor in robot.sensors:
        if sensor.driver == process.name and (sensor.driver_frames or sensor.claims):
            yield sensor


def _switch(sensor: MountedSensor) -> dict[str, Any]:
    """Return all parameters that stop the driver from publishing TF, even if they are not set."""
    inside = sensor.switch if sensor.driver_frames else None
    return _claim_of(sensor) | (inside or {})


def _claim_of(sensor: MountedSensor) -> dict[str, Any]:
    return {key: value for off in sensor.claims.values() for key, value in off.items()}


def _driven_sensor(sensor: MountedSensor, robot: Robot) -> Driven:
    switch = _claim_of(sensor) if sensor.publishes else _switch(sensor)
    inside = (edge for edge in robot.edges if edge.sensor == sensor.name and not edge.declared)
    frames: dict[str, PoseKnowledge] = {
        edge.child: _knowledge(edge) for edge in inside if edge.owner == sensor.driver
    }
    return Driven(sensor.name, sensor.preset, sensor.publishes, switch, frames)


def _knowledge(edge: Edge) -> PoseKnowledge:
    if not edge.pose_known:
        return "unknown"
    return "nominal" if edge.nominal else "exact"
