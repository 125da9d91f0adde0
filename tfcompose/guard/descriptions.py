"""Passes a new robot description to running robot_state_publishers.

A stock robot_state_publisher accepts ``robot_description`` while it runs, and then publishes
/tf_static and the description again. If a node rejects the description or does not answer, the
launcher restarts its process.
"""

from __future__ import annotations

import json
import re
import time
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.model.messages import DescriptionState
from tfcompose.tf.ros.service import ParameterWriter

if TYPE_CHECKING:
    from collections.abc import Callable

    from rclpy.node import Node

    from tfcompose.model.messages import DescriptionOrder, GuardEvent

#: Maximum time for a node's answer, in seconds.
ANSWER_S = 5.0
_NAME = "robot_description"
#: The line with the description in a parameter file that tfcompose wrote.
_LINE = re.compile(rf'^ +"{_NAME}": ("[^\n]*")$', re.MULTILINE)


class Descriptions:
    """Descriptions that nodes have not accepted yet, by process."""

    def __init__(self, node: Node, emit: Callable[[GuardEvent], None]) -> None:
        self._node = node
        self._emit = emit
        self._writers: dict[str, tuple[ParameterWriter, float]] = {}

    def take(self, order: DescriptionOrder) -> None:
        """Queue a description for a node. It replaces a description that is still waiting."""
        self.forget(order.process)
        try:
            match = _LINE.search(Path(order.file).read_text(encoding="utf-8"))
        except (OSError, UnicodeDecodeError) as error:
            self._emit(DescriptionState(order.process, f"{order.file} cannot be read: {error}"))
            return
        if match is None:
            self._emit(DescriptionState(order.process, f"{order.file} has no description"))
            return
        writer = ParameterWriter(self._node, order.node, _NAME, json.loads(match[1]))
        self._writers[order.process] = writer, time.monotonic()

    def forget(self, process: str) -> None:
        """Drop the description for a process that ended or was stopped."""
        writer, _ = self._writers.pop(process, (None, 0.0))
        if writer:
            writer.close()

    def check(self) -> None:
        """Send waiting descriptions, and report accepted and rejected ones."""
        for process, (writer, since) in list(self._writers.items()):
            why = writer.refusal()
            if why is None and time.monotonic() - since > ANSWER_S:
                why = f"it did not answer within {ANSWER_S:g} s"
            if why is not None:
                self.forget(process)
                self._emit(DescriptionState(process, why))
