"""Launch file with stock nodes for fixed edges and joints, and a node for each process."""

from __future__ import annotations

import graphlib
from typing import TYPE_CHECKING

from tfcompose.model.files import File
from tfcompose.model.plan import STOCK_DESCRIPTION
from tfcompose.model.plan.middleware import middleware_variables
from tfcompose.model.plan.stock import OWN_KINDS
from tfcompose.model.process_keys import PROCESS_KEYS
from tfcompose.tools.exporters.launch_actions import (
    Action,
    AfterExit,
    Delayed,
    Include,
    LoadComponents,
    SetVariable,
    StartCommand,
    StartFromPlan,
    StartNode,
)
from tfcompose.tools.exporters.launch_commands import (
    full_name,
    included_file,
    is_command,
    is_launch,
    is_node,
    program,
    split_ros_arguments,
)
from tfcompose.tools.exporters.launch_containers import Containers
from tfcompose.tools.exporters.launch_frontends import FrontendWriter
from tfcompose.tools.exporters.launch_processes import ProcessTexts
from tfcompose.tools.exporters.launch_python import write_python
from tfcompose.tools.exporters.launch_stock import other_fixed_edges, stock_nodes
from tfcompose.tools.exporters.launch_values import LaunchValues
from tfcompose.tools.exporters.supervisors import plain_name, waiting_s

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from tfcompose.model.plan import Plan, PlanEdge, PlanProcess
    from tfcompose.tools.exporters.launch_frontends import LaunchFile


def launch(
    plan: Plan, file: LaunchFile, urdf: str, values: LaunchValues | None = None
) -> tuple[tuple[File, ...], list[str]]:
    """Return the launch file, and a sentence for each property of the plan that it does not keep.

    ``urdf`` is the text of ``STOCK_DESCRIPTION``, a file next to the plan. In the launch file, a
    stock robot_state_publisher sends the fixed edges and joints of this URDF, and a
    static_transform_publisher sends each other fixed edge. If these stock nodes cannot send all
    edges of tfcompose's own publishers, the launch file starts tfcompose's own publishers instead.
    ``values`` are arguments and conditions that the launch file evaluates when it starts.

    Raises:
        RejectedError: if a process needs a feature that launch files of this format do not have.
    """
    values = values or LaunchValues()
    export = _Export(plan, values)
    actions = list(export.actions(other_fixed_edges(plan, urdf)))
    name = f"{plain_name(plan.robot)}.launch"
    if file.format == "python":
        text = write_python(plan.robot, file.folder, values, actions)
        return (File(f"{name}.py", text),), export.gaps
    writer = FrontendWriter(file, values)
    text = writer.write(plan.robot, actions)
    return (File(f"{name}.{file.format}", text),), [*export.gaps, *writer.gaps]


class _Export:
    """Collects the actions of a launch file, and in ``gaps`` what they do not keep of the plan."""

    def __init__(self, plan: Plan, values: LaunchValues) -> None:
        self.plan, self.values = plan, values
        self.processes = (*plan.managed, *values.more)
        self.processes_by_name = {
            process.name: process for process in (*plan.processes, *values.more)
        }
        self.gaps: list[str] = []
        self._awaited: set[str] = set()
        self._delays_s = _delays_s(self.processes_by_name)
        self._texts = ProcessTexts(values)
        self._containers = Containers(self.processes_by_name, self._texts, self._starts_with)
        for process in self.processes:
            self._containers.add(process)

    def actions(self, stock: list[PlanEdge] | None) -> Iterator[Action]:
        """Yield the actions in the order of the launch file.

        ``stock`` are the edges for static_transform_publishers, or None if tfcompose's own
        publishers send all edges.
        """
        plan = self.plan
        for name, value in _variables(plan):
            yield SetVariable(name=name, value=value)
        if stock is not None:
            yield from stock_nodes(plan, stock)
            self.gaps.append(
                f"robot_description is {STOCK_DESCRIPTION}, in which edges of other owners are"
                " floating joints"
            )
        self._awaited = self._awaited_processes(stock)
        for process in self.processes:
            if process.kind == "guard":
                self.gaps.append("the guard is left out: it belongs to tfcompose up")
            elif process.kind not in OWN_KINDS or (stock is None and process.owns):
                yield from self._actions_of(process)
            elif stock is None:
                self.gaps.append(f"{process.name} is left out: it publishes no edge")

    def _actions_of(self, process: PlanProcess) -> Iterator[Action]:
        """Yield the action that starts a process.

        Yield nothing if the action of its container loads it.
        """
        before = self._before(process)
        self._report_waits(process, before[:1])
        self.gaps += self._unlike(process)
        if self._containers.comes_with_container(process):
            return
        action = self._start(process)
        delay_s = self._delays_s[process.name]
        if delay_s:
            action = Delayed(process=process.name, action=action, delay_s=delay_s)
        if before:
            action = AfterExit(process=process.name, action=action, awaited=before[0])
        yield action

    def _before(self, process: PlanProcess) -> list[str]:
        """Return the processes that must exit before this process starts."""
        return [
            name
            for name, event in process.after.items()
            if event == "done" and name in self._awaited
        ]

    def _starts_with(self, component: PlanProcess, container: PlanProcess) -> bool:
        """Return True if a component waits only for its container."""
        same_delay = self._delays_s[component.name] == self._delays_s[container.name]
        return same_delay and not self._before(component)

    def _awaited_processes(self, stock: list[PlanEdge] | None) -> set[str]:
        """Return the processes that other processes wait for and that have their own action."""
        replaced = set() if stock is None else OWN_KINDS
        names = {
            name
            for process in self.processes
            for name, event in process.after.items()
            if event == "done"
        }
        return {
            process.name
            for process in self.processes
            if process.name in names
            and process.kind not in {"guard", *replaced}
            and not is_launch(process)
            and not process.lifecycle
        }

    def _report_waits(self, process: PlanProcess, before: list[str]) -> None:
        """Add a sentence for each process that this process waits for only under ``up``."""
        container = process.component.container if process.component else ""
        rest = [
            name
            for name, event in process.after.items()
            if name in self.processes_by_name
            and name not in {*before, container}
            and not waiting_s(self.processes_by_name[name], event)
        ]
        if rest:
            self.gaps.append(
                f"{process.name} does not wait for {', '.join(rest)}: launch has no readiness"
            )
        self.gaps += [f"{process.name} also starts if {name} fails" for name in before]

    def _unlike(self, process: PlanProcess) -> Iterator[str]:
        """Yield a sentence for each difference between launch and ``up`` for this process."""
        yield from _unlike(process)
        loads = self._containers.components_of(process.name)
        if loads and process.restart != "no":
            yield (
                f"a restarted {process.name} comes back without its components: {', '.join(loads)}"
            )

    def _start(self, process: PlanProcess) -> Action:
        name, condition = process.name, self._texts.condition(process)
        if process.component:
            return LoadComponents(
                process=name,
                condition=condition,
                container=self.processes_by_name[process.component.container].nodes[0],
                components=(self._containers.component(process),),
            )
        if is_launch(process):
            return self._include(process)
        if is_node(process):
            return self._node(process)
        if is_command(process):
            return StartCommand(
                process=name,
                condition=condition,
                argv=self._texts.arguments(process, process.argv),
                settings=self._texts.settings(process),
            )
        settings = self._texts.settings(process, is_own=False)
        return StartFromPlan(process=name, condition=condition, settings=settings)

    def _node(self, process: PlanProcess) -> StartNode:
        package, executable = program(process)
        arguments, ros_arguments = split_ros_arguments(process)
        namespace, name = full_name(process)
        has_file = "--params-file" in process.argv
        return StartNode(
            process=process.name,
            condition=self._texts.condition(process),
            package=package,
            executable=executable,
            name=name,
            namespace=namespace,
            exec_name="" if process.nodes[0].endswith(f"/{process.name}") else process.name,
            remap=self._texts.remap(process),
            arguments=self._texts.arguments(process, arguments),
            ros_arguments=tuple(self._texts.text(process, argument) for argument in ros_arguments),
            params_file=self._texts.file(process) if has_file else None,
            params=self._texts.made_params(process),
            settings=self._texts.settings(process),
            components=self._containers.loaded_by(process),
            lifecycle_state=process.lifecycle.get(process.nodes[0], ""),
        )

    def _include(self, process: PlanProcess) -> Include:
        """Return the included launch file with its arguments and the settings of its nodes."""
        plan, (package, file) = self.plan, included_file(process)
        namespace = plan.ros.namespace if process.namespace is None else process.namespace
        made = self._texts.texts_of(process, "args")
        pairs = [argument.split(":=", 1) for argument in process.argv[1:]]
        return Include(
            process=process.name,
            condition=self._texts.condition(process),
            package=package,
            file=file,
            arguments=tuple(
                (name, made.get(str(index), self._texts.text(process, value)))
                for index, (name, value) in enumerate(pairs)
            ),
            env=self._texts.environment(process),
            namespace=namespace or "",
            remap={old: (new,) for old, new in process.remap.items()},
            use_sim_time=plan.ros.clock == "sim",
        )


def _delays_s(processes: Mapping[str, PlanProcess]) -> dict[str, float]:
    """Return the delay of each process after the start of the launch file, in seconds.

    If a process waits for a process with ``ready: {time: …}``, this time is added to the delay of
    that process.
    """
    delays: dict[str, float] = {}
    waiting = {
        name: {awaited: event for awaited, event in process.after.items() if awaited in processes}
        for name, process in processes.items()
    }
    for name in graphlib.TopologicalSorter(waiting).static_order():
        waits = (
            delays[awaited] + waiting_s(processes[awaited], event)
            for awaited, event in waiting[name].items()
        )
        delays[name] = max(waits, default=0.0)
    return delays


def _unlike(process: PlanProcess) -> Iterator[str]:
    if process.component and process.lifecycle:
        yield f"{process.name} is a component: launch does not set its lifecycle state"
    if process.kind == "run" and process.lifecycle and not is_node(process):
        yield (
            f"launch does not set the lifecycle state of {', '.join(process.lifecycle)} in"
            f" {process.name}"
        )
    for key in PROCESS_KEYS:
        if key.launch is None or not key.is_set(process):
            continue
        if not is_launch(process):
            yield from key.launch.gaps(process)
        elif key.launch.of_file:
            yield from key.launch.of_file(process)
        else:
            yield f"{process.name} is a launch file, for which launch has no {key.name}"


def _variables(plan: Plan) -> Iterator[tuple[str, str]]:
    if plan.ros.domain_id is not None:
        yield "ROS_DOMAIN_ID", str(plan.ros.domain_id)
    if plan.ros.discovery is not None:
        yield "ROS_AUTOMATIC_DISCOVERY_RANGE", plan.ros.discovery.upper()
    yield from middleware_variables(plan.ros, {}).items()
