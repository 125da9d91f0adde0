"""The guard's knowledge about each edge, published on /diagnostics (DiagnosticArray)."""

from __future__ import annotations

import time
from dataclasses import dataclass
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from tfcompose.tf.process import say

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from rclpy.node import Node

    from tfcompose.foundation.findings import Finding
    from tfcompose.guard.judge import Judge
    from tfcompose.guard.liveness import EdgeHealth


_TOPIC = "/diagnostics"
_SECOND_NS = 1_000_000_000
OK, WARN, ERROR, STALE = 0, 1, 2, 3


@dataclass(frozen=True, slots=True)
class Status:
    """An entry of a diagnostics message."""

    name: str
    #: OK, WARN, ERROR or STALE.
    level: int
    message: str
    #: Pairs of key and value.
    values: Sequence[tuple[str, str]] = ()


class DiagnosticsPublisher:
    """Publishes statuses of the robot named ``hardware_id``."""

    def __init__(self, node: Node, hardware_id: str) -> None:
        from diagnostic_msgs import msg  # noqa: PLC0415 (the package is optional)

        self._messages: Any = msg
        self._hardware_id = hardware_id
        self._publisher: Any = node.create_publisher(self._messages.DiagnosticArray, _TOPIC, 10)

    @staticmethod
    def is_installed() -> bool:
        """Return whether the package diagnostic_msgs is installed."""
        return find_spec("diagnostic_msgs") is not None

    @property
    def is_heard(self) -> bool:
        """Whether the topic has a subscriber."""
        return bool(self._publisher.get_subscription_count())

    def publish(self, statuses: Sequence[Status], stamp_ns: int) -> None:
        """Publish the statuses with a stamp in nanoseconds."""
        array = self._messages.DiagnosticArray(
            status=[self._status(status) for status in statuses]
        )
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


EVERY_S = 1.0
_NAMES = {OK: "ok", WARN: "warning", ERROR: "error", STALE: "not seen"}


def _level(edge: EdgeHealth) -> int:
    if edge.age_s is None:
        return STALE
    return ERROR if edge.silent else WARN if edge.slow else OK


def held_status(robot: str, held: Mapping[tuple[str, str, str], int]) -> Status:
    """Return the status of edges that a strict guard blocked.

    ``held`` counts blocked transforms by the sender's node, parent and child.
    """
    lines = [
        (f"{parent} → {child} from {who}", str(count))
        for (who, parent, child), count in held.items()
    ]
    message = f"{sum(held.values())} transforms were held back"
    return Status(f"tfcompose {robot}: strict", WARN if held else OK, message, lines)


def statuses(robot: str, edges: Sequence[EdgeHealth], findings: Sequence[Finding]) -> list[Status]:
    """Return a status for the tree with current faults, and a status for each owner."""
    severe = any(finding.severity == "error" for finding in findings)
    level = ERROR if severe else WARN if findings else OK
    message = (
        "; ".join(f"{finding.code} {finding.message}" for finding in findings)
        or f"{len(edges)} edges watched"
    )
    lines = [
        Status(
            f"tfcompose {robot}: tree",
            level,
            message,
            [(finding.code, finding.message) for finding in findings],
        )
    ]
    for owner in dict.fromkeys(edge.edge.owner for edge in edges):
        owned = [edge for edge in edges if edge.edge.owner == owner]
        # Not received yet is worse than OK and better than silent.
        worst = max((_level(edge) for edge in owned), key=[OK, WARN, STALE, ERROR].index)
        number = sum(_level(edge) == worst for edge in owned)
        summary = f"{number} of {len(owned)} edges: {_NAMES[worst]}"
        lines.append(
            Status(
                f"tfcompose {robot}: {owner}",
                worst,
                summary,
                [(edge.edge.name, edge.text) for edge in owned],
            )
        )
    return lines


class DiagnosticsPage:
    """Publishes the judges' knowledge on /diagnostics, each second while there are subscribers."""

    def __init__(self, node: Node, robot: str) -> None:
        self._robot = robot
        self._due = 0.0
        self._publisher = (
            DiagnosticsPublisher(node, robot) if DiagnosticsPublisher.is_installed() else None
        )
        if self._publisher is None:
            say("nothing on /diagnostics: the package diagnostic_msgs is not installed")

    def publish(
        self,
        judges: Sequence[Judge],
        sources: Sequence[Callable[[], list[Finding]]],
        held: Callable[[], Mapping[tuple[str, str, str], int] | None],
    ) -> None:
        """Publish if a message is due and has a subscriber.

        ``sources`` return the open findings, except for silent and slow edges. ``held`` returns
        counts of the transforms that a strict guard blocked.
        """
        now = time.monotonic()
        if self._publisher is None or now < self._due:
            return
        self._due = now + EVERY_S
        if self._publisher.is_heard:
            edges = [edge for judge in judges for edge in judge.health(now)]
            wrong = [finding for findings in sources for finding in findings()]
            page = statuses(self._robot, edges, wrong)
            if (counts := held()) is not None:
                page.append(held_status(self._robot, counts))
            self._publisher.publish(page, time.time_ns())
