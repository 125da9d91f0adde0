"""A container of components with the services of rclcpp_components.

``python -m tests.support.stand_in_container``.

It loads the plugins below, each a node of its own, one after the other as stock containers do.
Every request goes to the file that CONTAINER_LOG names, as a line of JSON.
"""

import json
import os
import sys
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

import rclpy
from composition_interfaces.srv import ListNodes, LoadNode, UnloadNode
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.parameter import Parameter, parameter_value_to_python

from tests.support.fake_nodes import message
from tfcompose.tf.ros.node import TFPublisher

LOG = Path(os.environ["CONTAINER_LOG"])
PLUGINS = ("demo::Empty", "demo::Static", "demo::Moving")
KEPT: list[Any] = []
from_message: Any = Parameter.from_parameter_msg


class Container:
    """The node of the container."""

    def __init__(self, node: Any) -> None:
        self.node = node
        self.loaded: dict[int, Any] = {}
        self.last = 0
        node.create_service(LoadNode, "~/_container/load_node", self.load)
        node.create_service(UnloadNode, "~/_container/unload_node", self.unload)
        node.create_service(ListNodes, "~/_container/list_nodes", self.list)

    def load(self, request: Any, response: Any) -> Any:
        fields = {
            "node": f"{request.node_namespace.rstrip('/')}/{request.node_name}",
            "plugin": f"{request.package_name}/{request.plugin_name}",
            "remap": list(request.remap_rules),
            "params": {parameter.name: _plain(parameter) for parameter in request.parameters},
            "extra": {argument.name: _plain(argument) for argument in request.extra_arguments},
        }
        with LOG.open("a") as log:
            log.write(json.dumps({"pid": os.getpid(), **fields}) + "\n")
        if request.plugin_name not in PLUGINS:
            response.error_message = "Failed to find class with the requested plugin name."
        else:
            node = component(request)
            self.last += 1
            self.loaded[self.last] = node
            self.node.executor.add_node(node)
            response.success, response.unique_id = True, self.last
            response.full_node_name = node.get_fully_qualified_name()
            node.get_logger().info(f"{request.plugin_name} is up")
        return response

    def unload(self, request: Any, response: Any) -> Any:
        node = self.loaded.pop(request.unique_id, None)
        if node is None:
            response.error_message = f"No node found with unique_id: {request.unique_id}"
            return response
        self.node.executor.remove_node(node)
        node.destroy_node()
        with LOG.open("a") as log:
            log.write(json.dumps({"pid": os.getpid(), "unloaded": request.unique_id}) + "\n")
        response.success = True
        return response

    def list(self, _request: Any, response: Any) -> Any:
        response.full_node_names = [
            node.get_fully_qualified_name() for node in self.loaded.values()
        ]
        response.unique_ids = list(self.loaded)
        return response


def _plain(parameter: Any) -> Any:
    value = parameter_value_to_python(parameter.value)
    return list(value) if hasattr(value, "__iter__") and not isinstance(value, str) else value


def component(request: Any) -> Any:
    """Return the node that a request asks for.

    ``edge`` is what a publisher of TF sends, parent and child.
    """
    words = [word for rule in request.remap_rules for word in ("-r", rule)]
    node: Any = Node(
        request.node_name,
        namespace=request.node_namespace,
        cli_args=["--ros-args", *words] if words else None,
        use_global_arguments=False,
        parameter_overrides=[from_message(parameter) for parameter in request.parameters],
        automatically_declare_parameters_from_overrides=True,
    )
    if request.plugin_name in {"demo::Static", "demo::Moving"}:
        edge = node.get_parameter("edge").value
        publisher = TFPublisher(node, static=request.plugin_name == "demo::Static")
        if request.plugin_name == "demo::Static":
            publisher.publish(message(0, (edge,)))
        else:
            node.create_timer(0.05, lambda: publisher.publish(message(time.time_ns(), (edge,))))
        KEPT.append(publisher)
    return node


def main() -> None:
    """Load what is asked for until a signal comes."""
    rclpy.init(args=sys.argv)
    node: Any = Node("component_manager")
    Container(node)
    with suppress(KeyboardInterrupt, ExternalShutdownException):
        rclpy.spin(node)


if __name__ == "__main__":
    main()
