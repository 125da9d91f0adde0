"""Containers, programs of rclcpp_components, and the components that they load.

In ROS 2 Jazzy, ``component_container`` has an executor with a single thread for all components.
``component_container_mt`` has an executor with several threads. ``component_container_isolated``
has an executor for each component, and gives it several threads with the option
``--use_multi_threaded_executor``. Each program offers the service ``~/_container/load_node``. A
component ignores remappings and parameters on the container's command line.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from tfcompose.compiler.resolve.hosts import entry_of
from tfcompose.compiler.resolve.processes import full_name, how, namespace_of
from tfcompose.foundation.findings import Finding, did_you_mean, finding
from tfcompose.model.plan import Component, Ready
from tfcompose.model.plan.components import LOAD
from tfcompose.model.robot import Node, Process

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.compiler.resolve.draft import Draft
    from tfcompose.model.plan import ProcessKind, StartCondition
    from tfcompose.spec.language.process import ContainerSpec, StartedSpec
    from tfcompose.spec.language.robot import RobotSpec
    from tfcompose.spec.load import Path

#: The program and its arguments, by isolation and executor.
PROGRAMS = {
    ("shared", "single"): ("component_container", ()),
    ("shared", "multi"): ("component_container_mt", ()),
    ("isolated", "single"): ("component_container_isolated", ()),
    ("isolated", "multi"): ("component_container_isolated", ("--use_multi_threaded_executor",)),
}


def container_process(name: str, declared: ContainerSpec, spec: RobotSpec) -> Process:
    """Return the process of a container. It is ready when it can load components."""
    path: Path = ("containers", name)
    namespace = namespace_of(declared, spec.ros.namespace)
    node = Node(
        full_name(namespace, declared.node or name), spec.key_span(path), path, declared.params
    )
    kind: ProcessKind = "external" if declared.external else "run"
    process = Process(name, kind, span=spec.key_span(path), ros_nodes=(node,), loads=True)
    process = replace(
        process, **how(declared, namespace, "external" if declared.external else "container")
    )
    process = replace(process, ready=process.ready or Ready("service", f"{node.name}/{LOAD}"))
    if declared.external:
        return process
    program, arguments = PROGRAMS[declared.isolation, declared.executor]
    return replace(
        process,
        package=declared.package,
        executable=declared.executable or program,
        argv=((*arguments, *declared.args) if declared.executable is None else declared.args),
    )


def component_process(process: Process, declared: StartedSpec, spec: RobotSpec) -> Process:
    """Return the process as a component of its container.

    The component runs on the container's host and shares the container's ``required`` flag.
    """
    package, _, plugin = (declared.component or "").partition("/")
    loaded: dict[str, StartCondition] = {declared.container or "": "ready"}
    name = declared.container or ""
    container = spec.containers.get(name)
    return replace(
        process,
        component=Component(name, package, plugin, extra_arguments=declared.extra_arguments),
        after=loaded | process.after,
        host=process.host or (container.host if container else None),
        required=(
            container.required if container and process.required is None else process.required
        ),
    )


def check_components(draft: Draft) -> Iterator[Finding]:
    """Yield findings about components.

    A missing container, or keys that a component cannot have.
    """
    for process in draft.robot.processes[: len(draft.processes)]:  # only processes of this file
        if process.component:
            yield from _check_component(process, process.component, draft)


def _check_component(process: Process, component: Component, draft: Draft) -> Iterator[Finding]:
    spec = draft.spec
    path = entry_of(process, spec)
    name, containers = component.container, spec.containers
    if name not in containers and ("containers", name) not in draft.validated.broken:
        otherwise = f"containers: {{{name}: {{}}}}"
        if any(name in section for section in (spec.processes, spec.sensors)):
            otherwise = (
                f"name a container: {', '.join(containers)}"
                if containers
                else "containers: {NAME: {}}"
            )
        advice = did_you_mean(name, containers, otherwise)
        message = f"the container of {process.name} is {name}, which is not a container"
        yield finding("TF813", message, spec.span_of((*path, "container")), help=advice)
    if process.ready and process.ready.kind in {"exit", "log"}:
        lacks = "never exits" if process.ready.kind == "exit" else "has no output"
        message = f"{process.name} is a component: it {lacks} on its own"
        span = spec.key_span((*path, "ready", process.ready.kind))
        yield finding(
            "TF107", message, span, help="wait for edges, a topic, a service or a lifecycle state"
        )
    for where, values in (
        ("params", process.ros_nodes[0].flat_params),
        ("extra_arguments", component.extra_arguments),
    ):
        for key, value in values.items():
            if (wrong := _not_a_parameter(value)) and spec.spans.has((*path, where)):
                exact: Path = (*path, where, *key.split("."))
                place = exact if spec.spans.has(exact) else (*path, where)
                yield finding(
                    "TF103", f"{process.name}: {key} is {wrong}", spec.span_of(place), help=_KINDS
                )


_KINDS = "a parameter is true or false, a number, a string, or a list of one of these"


def _not_a_parameter(value: object) -> str:
    """Return why ROS has no parameter of this type; empty if ROS has."""
    if not isinstance(value, list):
        return (
            ""
            if isinstance(value, (bool, int, float, str))
            else "nothing"
            if value is None
            else "a mapping"
        )
    if not value:
        return "an empty list, which has no type"
    kinds = {_kind_of(item) for item in value}
    return "a list of several kinds" if len(kinds) > 1 or None in kinds else ""


def _kind_of(item: object) -> type | None:
    """Return the parameter type of an item of a list. All numbers count as the same type."""
    if isinstance(item, bool):
        return bool
    if isinstance(item, (int, float)):
        return float
    return str if isinstance(item, str) else None
