"""The guard's view as diagnostic_msgs/DiagnosticArray on /diagnostics, for the tools that read it there."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rclpy.node import Node

TOPIC = "/diagnostics"
_SECOND_NS = 1_000_000_000
OK, WARN, ERROR, STALE = 0, 1, 2, 3


@dataclass(frozen=True, slots=True)
class Status:
    """One line of a diagnostics page: ``level`` is one of OK, WARN, ERROR, STALE; ``values`` are keys and values."""

    name: str
    level: int
    message: str
    values: Sequence[tuple[str, str]] = ()


class DiagnosticsPublisher:
    """Publishes statuses about the robot that is called ``hardware_id``."""

    def __init__(self, node: Node, hardware_id: str) -> None:
        self._messages: Any = import_module("diagnostic_msgs.msg")
        self._hardware_id = hardware_id
        self._publisher: Any = node.create_publisher(self._messages.DiagnosticArray, TOPIC, 10)

    @staticmethod
    def is_installed() -> bool:
        """Return whether the package diagnostic_msgs is there."""
        return find_spec("diagnostic_msgs") is not None

    @property
    def is_heard(self) -> bool:
        """Whether anybody listens."""
        return bool(self._publisher.get_subscription_count())

    def publish(self, statuses: Sequence[Status], stamp_ns: int) -> None:
        """Publish them with this time, in nanoseconds."""
        array = self._messages.DiagnosticArray(status=[self._status(status) for status in statuses])
        array.header.stamp.sec, array.header.stamp.nanosec = divmod(stamp_ns, _SECOND_NS)
        self._publisher.publish(array)

    def _status(self, status: Status) -> Any:
        return self._messages.DiagnosticStatus(
            level=bytes([status.level]),
            name=status.name,
            message=status.message,
            hardware_id=self._hardware_id,
            values=[self._messages.KeyValue(key=key, value=value) for key, value in status.values],
        )
