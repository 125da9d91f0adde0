"""The guard's page on /diagnostics, written once a second while anybody reads it."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from tfcompose.ros.diagnostics import DiagnosticsPublisher
from tfcompose.run.health import statuses
from tfcompose.run.own import say

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rclpy.node import Node

    from tfcompose.run.judge import Judge

EVERY_S = 1.0


class Bulletin:
    """Publishes what judges know of the robot."""

    def __init__(self, node: Node, robot: str) -> None:
        self._robot = robot
        self._due = 0.0
        self._publisher = DiagnosticsPublisher(node, robot) if DiagnosticsPublisher.is_installed() else None
        if self._publisher is None:
            say("nothing on /diagnostics: the package diagnostic_msgs is not installed")

    def look(self, judges: Sequence[Judge]) -> None:
        """Publish if it is time to, and somebody listens."""
        now = time.monotonic()
        if self._publisher is None or now < self._due:
            return
        self._due = now + EVERY_S
        if self._publisher.is_heard:
            edges = [edge for judge in judges for edge in judge.health(now)]
            wrong = [one for judge in judges for one in judge.wrong()]
            self._publisher.publish(statuses(self._robot, edges, wrong), time.time_ns())
