"""Parameters of another process's node, queried without blocking."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rcl_interfaces.msg import ParameterType
from rcl_interfaces.srv import GetParameters

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rclpy.node import Node

#: Maximum wait for an answer in seconds, before the request is repeated.
ANSWER_S = 10.0

Value = bool | int | float | str

_FIELDS = {
    ParameterType.PARAMETER_BOOL: "bool_value",
    ParameterType.PARAMETER_INTEGER: "integer_value",
    ParameterType.PARAMETER_DOUBLE: "double_value",
    ParameterType.PARAMETER_STRING: "string_value",
}


class ParameterReader:
    """Reads some parameters of a node.

    Requests are sent and answers read directly, because nothing spins the node.
    """

    def __init__(self, node: Node, name: str, parameters: Sequence[str]) -> None:
        self._node = node
        self._parameters = list(parameters)
        self._client: Any = node.create_client(GetParameters, f"{name}/get_parameters")
        self._sequence: int | None = None
        self._requested_at = 0.0

    def close(self) -> None:
        """Destroy the client."""
        self._node.destroy_client(self._client)

    @property
    def is_there(self) -> bool:
        """Whether the node offers its parameter service."""
        return bool(self._client.service_is_ready())

    def ask(self, now: float) -> None:
        """Send a request, unless an answer is pending."""
        if self._sequence is not None and now - self._requested_at < ANSWER_S:
            return
        request = GetParameters.Request(names=self._parameters)
        with self._client.handle:
            self._sequence, self._requested_at = self._client.handle.send_request(request), now

    def take(self) -> dict[str, Value | None] | None:
        """Return the values if the answer has arrived, otherwise None.

        The value is None for a parameter that the node does not declare, or that is not a bool, a
        number or a string.
        """
        if self._sequence is None:
            return None
        with self._client.handle:
            header, response = self._client.handle.take_response(GetParameters.Response)
        if header is None or header.request_id.sequence_number != self._sequence:
            return None
        self._sequence = None
        # If one of the parameters does not exist, rclcpp's answer is empty.
        values = dict.fromkeys(self._parameters)
        return values | {
            name: _value(parameter)
            for name, parameter in zip(self._parameters, response.values, strict=False)
        }


def _value(message: Any) -> Value | None:
    field = _FIELDS.get(message.type)
    value: Value | None = getattr(message, field) if field else None
    return value
