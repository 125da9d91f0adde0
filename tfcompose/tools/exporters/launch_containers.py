"""Containers of a launch file, and the components that they load."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.model.plan.components import ros_value
from tfcompose.model.process_keys import EXTRA_ARGUMENTS
from tfcompose.tools.exporters.launch_actions import LoadedComponent
from tfcompose.tools.exporters.launch_commands import full_name, is_node

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from tfcompose.model.plan import PlanProcess
    from tfcompose.tools.exporters.launch_processes import ProcessTexts


class Containers:
    """The components of each container.

    If a component waits only for its container, the action of the container loads it. All other
    components have their own action.
    """

    def __init__(
        self,
        processes: Mapping[str, PlanProcess],
        texts: ProcessTexts,
        starts_with: Callable[[PlanProcess, PlanProcess], bool],
    ) -> None:
        """Set ``processes``, which are all processes of the plan by name.

        ``starts_with`` returns True if a component waits only for its container.
        """
        self._processes, self._texts, self._starts_with = processes, texts, starts_with
        self._components: dict[str, list[PlanProcess]] = {}

    def add(self, process: PlanProcess) -> None:
        """Add the process if it is a component."""
        if process.component:
            self._components.setdefault(process.component.container, []).append(process)

    def components_of(self, container: str) -> list[str]:
        """Return the names of a container's components."""
        return [process.name for process in self._components.get(container, [])]

    def comes_with_container(self, process: PlanProcess) -> bool:
        """Return True if the action of the component's container loads the component.

        In that case launch starts the container itself.
        """
        container = self._processes.get(process.component.container) if process.component else None
        return (
            container is not None
            and container.kind == "run"
            and is_node(container)
            and self._starts_with(process, container)
        )

    def loaded_by(self, container: PlanProcess) -> tuple[LoadedComponent, ...] | None:
        """Return the components that a container's action loads; None if it is not a container."""
        if container.name not in self._components:
            return None
        return tuple(
            self.component(process)
            for process in self._components[container.name]
            if self.comes_with_container(process)
        )

    def component(self, process: PlanProcess) -> LoadedComponent:
        """Return the component for a launch action.

        It contains its condition only if the action of its container loads it.
        """
        if process.component is None:
            raise ValueError(f"{process.name} is not a component")
        component = process.component
        namespace, name = full_name(process)
        params = {
            name: self._texts.param(process, ros_value(value))
            for name, value in component.params.items()
        }
        extra = EXTRA_ARGUMENTS.launch.settings(process) if EXTRA_ARGUMENTS.launch else ()
        conditions = self._texts.values.conditions
        needs_condition = self.comes_with_container(process) and conditions.get(
            process.name
        ) != conditions.get(component.container)
        return LoadedComponent(
            package=component.package,
            plugin=component.plugin,
            name=name,
            namespace=namespace,
            remap=self._texts.remap(process),
            params=params | self._texts.made_params(process),
            settings=tuple(extra),
            condition=self._texts.condition(process) if needs_condition else None,
        )
