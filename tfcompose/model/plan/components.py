"""Load requests for component containers, shared by the launcher and the guard.

Names are those of rclcpp_components (ROS 2 Jazzy): a container offers ``~/_container/load_node``
and others beside it. A component takes nothing from the container's command line, so that its
remappings and parameters go with the request.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from tfcompose.model.plan.plan import Component  # noqa: TC001 (read by its annotations)
from tfcompose.model.plan.topics import GLOBAL, private_topics

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from tfcompose.model.plan import Plan, PlanProcess

#: The services, below the container's node.
LOAD, UNLOAD, LIST = "_container/load_node", "_container/unload_node", "_container/list_nodes"


#: In JSON, the key of a number that is infinite or none.
_DOUBLE = "double"


@dataclass(frozen=True, slots=True)
class LoadRequest:
    """A component to load, with values of parameters as ROS has them.

    A list has values of one kind; a list of whole and other numbers counts as one of others.
    """

    #: The full name of the container's node.
    container: str
    #: The full name of the component's node.
    node: str
    component: Component
    remap: dict[str, str] = field(default_factory=dict)

    @property
    def what(self) -> str:
        """The component as people write it."""
        return f"{self.component.package}/{self.component.plugin}"


def load_file(folder: Path, process: str) -> Path:
    """Return the file, in the folder of a run's plan, that holds a component's request."""
    return folder / "load" / f"{process.replace('/', '.')}.json"


def load_request(
    plan: Plan, process: PlanProcess, fill: Callable[[str], str], *, private: bool
) -> LoadRequest:
    """Return the request for a component of the plan.

    ``fill`` replaces what only the starting machine knows.

    With ``private`` the processes of a strict plan are remapped to TF topics of their own.

    Raises:
        ValueError: if the process is no component, or its container has no node.
    """
    component = process.component
    container = next(
        (
            process
            for process in plan.processes
            if component and process.name == component.container
        ),
        None,
    )
    if component is None or container is None or not container.nodes or not process.nodes:
        raise ValueError(f"the plan does not say which container loads {process.name}")
    remap = process.remap
    if private and (own := private_topics(plan).get(process.name)):
        remap = dict([*zip(GLOBAL, own, strict=True), *zip(process.topics, own, strict=True)])
        remap |= {old: new for old, new in process.remap.items() if old not in remap}
    params = {name: _fill(value, fill) for name, value in component.params.items()}
    loaded = replace(component, params=params)
    return LoadRequest(container.nodes[0], process.nodes[0], loaded, remap)


def json_value(value: Any) -> Any:
    """Return a parameter's value as JSON has it, which has no infinite numbers."""
    if isinstance(value, list):
        return [json_value(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return {_DOUBLE: str(value)}
    return value


def ros_value(value: Any) -> Any:
    """Return the value of a parameter that ``json_value`` made."""
    if isinstance(value, list):
        return [ros_value(item) for item in value]
    return float(value[_DOUBLE]) if isinstance(value, dict) else value


def _fill(value: Any, fill: Callable[[str], str]) -> Any:
    if isinstance(value, list):
        return [_fill(item, fill) for item in value]
    return fill(value) if isinstance(value, str) else value
