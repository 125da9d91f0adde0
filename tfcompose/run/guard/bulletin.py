"""The guard's page on /diagnostics, written once a second while anybody reads it."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from tfcompose.ros.diagnostics import DiagnosticsPublisher
from tfcompose.run.guard.health import held_status, statuses
from tfcompose.run.own import say

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from rclpy.node import Node

    from tfcompose.run.guard.judge import Judge

EVERY_S = 1.0


class Bulletin:
    """Publishes what judges know of the robot."""

    def __init__(self, node: Node, robot: str) -> None:
        self._robot = robot
        self._due = 0.0
        self._publisher = DiagnosticsPublisher(node, robot) if DiagnosticsPublisher.is_installed() else None
        if self._publisher is None:
            say("nothing on /diagnostics: the package diagnostic_msgs is not installed")

    def look(self, judges: Sequence[Judge], held: Callable[[], Mapping[tuple[str, str, str], int] | None]) -> None:
        """Publish if it is time to, and somebody listens; ``held`` says what a strict guard held back."""
        now = time.monotonic()
        if self._publisher is None or now < self._due:
            return
        self._due = now + EVERY_S
        if self._publisher.is_heard:
            edges = [edge for judge in judges for edge in judge.health(now)]
            wrong = [one for judge in judges for one in judge.wrong()]
            page = statuses(self._robot, edges, wrong)
            if (counts := held()) is not None:
                page.append(held_status(self._robot, counts))
            self._publisher.publish(page, time.time_ns())
