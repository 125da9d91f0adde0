"""The services of a component container: load, unload and list, called without blocking.

In ROS 2 Jazzy, a container of rclcpp_components handles requests in sequence. It answers a load
request after the component's constructor has returned, and reports a failure in ``error_message``.
This module needs composition_interfaces, which is installed with the containers.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from composition_interfaces.srv import ListNodes, LoadNode, UnloadNode

from tfcompose.model.plan.components import LIST, LOAD, UNLOAD
from tfcompose.tf.ros.service import Service, parameter

if TYPE_CHECKING:
    from rclpy.node import Node

    from tfcompose.model.plan.components import LoadRequest


class Container:
    """The services of the container whose node has this full name."""

    def __init__(self, node: Node, name: str) -> None:
        self.name = name
        self.load = Service(node, LoadNode, f"{name}/{LOAD}")
        self.unload = Service(node, UnloadNode, f"{name}/{UNLOAD}")
        self.list = Service(node, ListNodes, f"{name}/{LIST}")

    def close(self) -> None:
        """Destroy the clients."""
        for service in (self.load, self.unload, self.list):
            service.close()

    def ask_to_load(self, request: LoadRequest) -> None:
        """Send a request to load a component.

        Raises:
            ValueError: if ROS has no parameter type for a value.
        """
        namespace, _, name = request.node.rpartition("/")
        component = request.component
        self.load.ask(
            package_name=component.package,
            plugin_name=component.plugin,
            node_name=name,
            node_namespace=namespace or "/",
            remap_rules=[f"{old}:={new}" for old, new in request.remap.items()],
            parameters=[parameter(*item) for item in component.params.items()],
            extra_arguments=[
                parameter(*argument) for argument in component.extra_arguments.items()
            ],
        )
