"""Whether nodes have taken the switches that the plan wrote for them: their parameters are read back.

Each node is asked once after it appears. Drivers declare parameters late, once they have found their device: one that
is not there yet is asked for again, for a while. A node that leaves and comes back is asked anew.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

from tfcompose.guard.judge import FINDING_S
from tfcompose.ipc import Found
from tfcompose.verdict.drivers import not_taken

if TYPE_CHECKING:
    from collections.abc import Callable, Collection

    from rclpy.node import Node

    from tfcompose.ipc import GuardEvent
    from tfcompose.plan import Driven, Plan
    from tfcompose.ros.parameters import ParameterReader, Value

#: How often nodes are looked for, in seconds.
CHECK_EVERY_S = 0.5
#: For so long a parameter that the node does not have is asked for again, so often.
DECLARED_WITHIN_S = 20.0
AGAIN_EVERY_S = 2.0


@dataclass(slots=True)
class _NodeSwitches:
    """One node: what the plan wrote, for which sensors, and how far the question is."""

    node: str
    wanted: dict[str, Value]
    drives: tuple[Driven, ...]
    reader: ParameterReader
    since: float | None = None
    due: float = 0.0
    done: bool = False


class Switches:
    """The nodes whose switches are read back."""

    def __init__(self, node: Node, plan: Plan, emit: Callable[[GuardEvent], None]) -> None:
        self._emit = emit
        self._due = self._finds_until = 0.0
        self._nodes = [
            _NodeSwitches(name, wanted, process.drives, _reader(node, name, tuple(wanted)))
            for process in plan.processes
            for name, wanted in process.switches.items()
        ]

    @property
    def answered(self) -> list[str]:
        """The nodes that have been asked, and are there since."""
        return [one.node for one in self._nodes if one.done]

    def recall(self, answered: Collection[str]) -> None:
        """Ask these no more, unless they leave: the guard before this one has; those that are not found yet, too."""
        self._finds_until = time.monotonic() + FINDING_S
        for one in self._nodes:
            one.done = one.node in answered

    def check(self) -> None:
        """Take what was answered, ask whom there is to ask, and wait for nothing."""
        now = time.monotonic()
        if not self._nodes or now < self._due:
            return
        self._due = now + CHECK_EVERY_S
        for one in self._nodes:
            self._at(one, now)

    def _at(self, one: _NodeSwitches, now: float) -> None:
        if not one.reader.is_there:
            one.since, one.done = None, one.done and now < self._finds_until
            return
        if one.done:
            return
        if one.since is None:
            one.since = one.due = now
        found = one.reader.take()
        if found is None:
            if now >= one.due:
                one.reader.ask(now)
        elif None in found.values() and now - one.since < DECLARED_WITHIN_S:
            one.due = now + AGAIN_EVERY_S
        else:
            one.done = True
            for wrong in not_taken(one.node, one.wanted, found, one.drives):
                self._emit(Found(wrong))


def _reader(node: Node, name: str, parameters: tuple[str, ...]) -> ParameterReader:
    from tfcompose.ros.parameters import ParameterReader  # noqa: PLC0415 (its services are loaded where one is read)

    return ParameterReader(node, name, parameters)
