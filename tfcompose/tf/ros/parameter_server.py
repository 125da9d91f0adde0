"""Read-only parameters of tfcompose's node, for ``ros2 param``.

rclpy answers its parameter services in an executor, which a node from ``open_node`` does not have.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rcl_interfaces.msg import ParameterDescriptor, SetParametersResult
from rclpy.parameter import Parameter
from rclpy.parameter_service import ParameterService

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rclpy.node import Node

Value = bool | str | list[str]

_TYPES = {
    bool: Parameter.Type.BOOL,
    str: Parameter.Type.STRING,
    list: Parameter.Type.STRING_ARRAY,
}
_REASON = "parameters of tfcompose's nodes are read-only: change the robot file"


class ParameterServer:
    """The six standard parameter services of a node, answered by ``check``.

    ``descriptions`` has the description of each parameter that the node does not declare itself.
    """

    def __init__(
        self, node: Node, values: Mapping[str, Value], descriptions: Mapping[str, str]
    ) -> None:
        self._node: Any = node
        for name, text in descriptions.items():
            descriptor = ParameterDescriptor(description=text, read_only=True)
            kind = _TYPES[type(values[name])]
            node.declare_parameter(name, kind, descriptor, ignore_override=True)
        self._is_updating = False
        node.add_on_set_parameters_callback(self._admit)
        self.update(values)
        earlier = set(node.services)
        service: Any = ParameterService  # the same
        self._answers = service(node)
        self._services: list[Any] = [each for each in node.services if each not in earlier]

    def check(self) -> None:
        """Answer received requests without blocking."""
        for service in self._services:
            self._answer(service)

    def update(self, values: Mapping[str, Value]) -> None:
        """Change the values; the node reports the changes on ``/parameter_events``."""
        parameter: Any = Parameter  # rclpy does not say the types of its arguments
        descriptors = self._node.describe_parameters(list(values))
        for descriptor in descriptors:
            descriptor.read_only = False  # rclpy refuses a change of the node itself, too
        self._is_updating = True
        self._node.set_parameters(
            [
                parameter(name, _TYPES[type(value)], value)
                for name, value in values.items()
                if self._node.get_parameter_or(name).value != value
            ]
        )
        self._is_updating = False
        for descriptor in descriptors:
            descriptor.read_only = True

    def _answer(self, service: Any) -> None:
        try:
            with service.handle:
                request, header = service.handle.service_take_request(service.srv_type.Request)
            if header is not None:
                response = service.callback(request, service.srv_type.Response())
                service.send_response(response, header)
        except Exception:  # noqa: BLE001 (a malformed request ends no guard; rclpy raises many types)
            return

    def _admit(self, _: object) -> SetParametersResult:
        return SetParametersResult(
            successful=self._is_updating, reason="" if self._is_updating else _REASON
        )
