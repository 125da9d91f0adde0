"""A service of another process, called without blocking, and parameters as messages."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import SetParameters

from tfcompose.model.plan.components import ros_value
from tfcompose.tf.ros.graph import is_offered

if TYPE_CHECKING:
    from rclpy.node import Node

#: The field of ParameterValue for a single value, and its type number, by the value's Python type.
_SINGLE = {
    bool: ("bool_value", ParameterType.PARAMETER_BOOL),
    int: ("integer_value", ParameterType.PARAMETER_INTEGER),
    float: ("double_value", ParameterType.PARAMETER_DOUBLE),
    str: ("string_value", ParameterType.PARAMETER_STRING),
}
#: The same for a list, by the Python type of its items.
_LISTS = {
    bool: ("bool_array_value", ParameterType.PARAMETER_BOOL_ARRAY),
    int: ("integer_array_value", ParameterType.PARAMETER_INTEGER_ARRAY),
    float: ("double_array_value", ParameterType.PARAMETER_DOUBLE_ARRAY),
    str: ("string_array_value", ParameterType.PARAMETER_STRING_ARRAY),
}


def parameter(name: str, value: Any) -> Any:
    """Return a parameter as a message. Integers in a list with floats become floats.

    Raises:
        ValueError: if ROS has no parameter of this type.
    """
    value = ros_value(value)
    kinds = {type(item) for item in value} if isinstance(value, list) else {type(value)}
    kind = float if kinds == {int, float} else next(iter(kinds)) if len(kinds) == 1 else None
    field, number = (_LISTS if isinstance(value, list) else _SINGLE).get(kind, ("", 0))  # type: ignore[arg-type]
    if not field:
        raise ValueError(f"{name} is {value!r}, and ROS has no parameter of that kind")
    value = [float(item) for item in value] if kind is float and isinstance(value, list) else value
    return Parameter(name=name, value=ParameterValue(type=number, **{field: value}))


class Service:
    """A service of another process.

    Requests are sent and answers read directly, because nothing spins the node.
    """

    def __init__(self, node: Node, kind: Any, name: str) -> None:
        self._node = node
        self._client: Any = node.create_client(kind, name)
        self._name = name
        self._sequence: int | None = None

    def close(self) -> None:
        """Destroy the client."""
        self._node.destroy_client(self._client)

    @property
    def is_there(self) -> bool:
        """Whether a running node offers it."""
        return bool(self._client.service_is_ready()) and is_offered(self._node, self._name)

    def ask(self, **fields: Any) -> None:
        """Send a request; the answer to the previous one is dropped."""
        request = self._client.srv_type.Request(**fields)
        with self._client.handle:
            self._sequence = self._client.handle.send_request(request)

    def answer(self) -> Any:
        """Return the answer to the last request if it has arrived, otherwise None."""
        while self._sequence is not None:
            with self._client.handle:
                header, response = self._client.handle.take_response(
                    self._client.srv_type.Response
                )
            if header is None:
                return None
            if header.request_id.sequence_number == self._sequence:
                self._sequence = None
                return response
        return None


class ParameterWriter:
    """Sets a parameter of another node while the node runs."""

    def __init__(self, node: Node, name: str, key: str, value: Any) -> None:
        self._service = Service(node, SetParameters, f"{name}/set_parameters")
        self._parameter = parameter(key, value)
        self._is_sent = False

    def close(self) -> None:
        """Destroy the client."""
        self._service.close()

    def refusal(self) -> str | None:
        """Send the value once the node is present, and read the node's answer.

        The call does not wait: call it repeatedly until it returns a text. The text says why the
        node rejected the value, and is empty if the node accepted it. Until the answer has come,
        the result is None.
        """
        if not self._is_sent and self._service.is_there:
            self._service.ask(parameters=[self._parameter])
            self._is_sent = True
        answer = self._service.answer()
        if answer is None:
            return None
        (result,) = answer.results
        if result.successful:
            return ""
        return result.reason or "it does not say why"
