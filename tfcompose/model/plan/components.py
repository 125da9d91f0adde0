"""Load requests for component containers, shared by the launcher and the guard.

Names are those of rclcpp_components (ROS 2 Jazzy). A container offers the service
``~/_container/load_node`` and similar services. A component ignores the container's command line,
so the request contains its remappings and parameters.
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

#: Services of a container, relative to its node.
LOAD, UNLOAD, LIST = "_container/load_node", "_container/unload_node", "_container/list_nodes"


#: The JSON key for a number that is infinite or not a number.
_DOUBLE = "double"


@dataclass(frozen=True, slots=True)
class LoadRequest:
    """A component to load, with the values of its parameters as in ROS.

    A list has values of a single type. A list of integers and other numbers counts as a list of
    doubles.
    """

    #: The full name of the container's node.
    container: str
    #: The full name of the component's node.
    node: str
    component: Component
    remap: dict[str, str] = field(default_factory=dict)

    @property
    def what(self) -> str:
        """The component for display: package/plugin."""
        return f"{self.component.package}/{self.component.plugin}"


def load_file(folder: Path, process: str) -> Path:
    """Return the file for a component's request, in the folder of a run's plan."""
    return folder / "load" / f"{process.replace('/', '.')}.json"


def load_request(
    plan: Plan, process: PlanProcess, fill: Callable[[str], str], *, private: bool
) -> LoadRequest:
    """Return the request for a component of the plan.

    ``fill`` replaces placeholders for values that only the starting machine knows. With
    ``private``, remappings isolate the processes of a strict plan on separate TF topics.

    Raises:
        ValueError: if the process is not a component, or its container has no node.
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
    if private and (topics := private_topics(plan).get(process.name)):
        remap = dict(
            [*zip(GLOBAL, topics, strict=True), *zip(process.topics, topics, strict=True)]
        )
        remap |= {old: new for old, new in process.remap.items() if old not in remap}
    params = {name: _fill(value, fill) for name, value in component.params.items()}
    loaded = replace(component, params=params)
    return LoadRequest(container.nodes[0], process.nodes[0], loaded, remap)


def json_value(value: Any) -> Any:
    """Return a parameter's value for JSON, which has no infinite numbers."""
    if isinstance(value, list):
        return [json_value(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return {_DOUBLE: str(value)}
    return value


def ros_value(value: Any) -> Any:
    """Return the original value of a result of ``json_value``."""
    if isinstance(value, list):
        return [ros_value(item) for item in value]
    return float(value[_DOUBLE]) if isinstance(value, dict) else value


def _fill(value: Any, fill: Callable[[str], str]) -> Any:
    if isinstance(value, list):
        return [_fill(item, fill) for item in value]
    return fill(value) if isinstance(value, str) else value
