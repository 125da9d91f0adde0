"""The guard's eyes on gates: topics, services, and the lifecycle states of nodes, which it may also drive."""

from __future__ import annotations

import time
from importlib import import_module
from typing import TYPE_CHECKING

from tfcompose.ipc import Gate, GateOpen, GateShut
from tfcompose.ros.graph import is_offered, services, writers

if TYPE_CHECKING:
    from collections.abc import Callable

    from rclpy.node import Node

    from tfcompose.ipc import GuardEvent
    from tfcompose.ros.lifecycle import Lifecycle

#: How often a gate is looked at, in seconds.
LOOK_EVERY_S = 0.2
NAMED_AT_MOST = 6


class Gates:
    """The gates that are not open yet."""

    def __init__(self, node: Node, emit: Callable[[GuardEvent], None]) -> None:
        self._node = node
        self._emit = emit
        self._gates: dict[str, Gate] = {}
        self._nodes: dict[tuple[str, str], Lifecycle] = {}
        self._said: dict[str, str] = {}
        self._due = 0.0

    def add(self, gate: Gate) -> None:
        """Look at this gate from now on."""
        self.forget(gate.process)
        if gate == Gate(gate.process):
            return
        self._gates[gate.process] = gate
        for name, state in gate.nodes.items():
            self._nodes[gate.process, name] = _lifecycle(self._node, name, state, drive=gate.drive)

    def forget(self, process: str) -> None:
        """Look at the process's gate no more."""
        self._gates.pop(process, None)
        self._said.pop(process, None)
        for key in [key for key in self._nodes if key[0] == process]:
            self._nodes.pop(key).close()

    def look(self) -> None:
        """Look at all, from time to time, and say which are open and what is seen at the others."""
        now = time.monotonic()
        if not self._gates or now < self._due:
            return
        self._due = now + LOOK_EVERY_S
        for process, gate in list(self._gates.items()):
            is_open, seen = self._at(gate, now)
            if is_open:
                self.forget(process)
                self._emit(GateOpen(process, seen))
            elif self._said.get(process) != seen:
                self._said[process] = seen
                self._emit(GateShut(process, seen))

    def _at(self, gate: Gate, now: float) -> tuple[bool, str]:
        looks = [self._nodes[gate.process, name].look(now) for name in gate.nodes]
        if gate.topic:
            found = writers(self._node, gate.topic)
            seen = (
                f"{gate.topic} is published by {', '.join(one.node for one in found)}"
                if found
                else self._topics(gate.topic)
            )
            looks.append((bool(found), seen))
        if gate.service:
            is_there = is_offered(self._node, gate.service)
            seen = f"the service {gate.service} is there" if is_there else self._services(gate.service)
            looks.append((is_there, seen))
        for topic in gate.writers:
            names = ", ".join(one.node for one in writers(self._node, topic))
            looks.append((False, f"{topic} is published by {names or 'nobody'}"))
        return all(is_open for is_open, _ in looks), "; ".join(seen for _, seen in looks)

    def _topics(self, wanted: str) -> str:
        return _some("topics", [name for name, _ in self._node.get_topic_names_and_types()], wanted)

    def _services(self, wanted: str) -> str:
        return _some("services", services(self._node), wanted)


def _some(what: str, names: list[str], wanted: str) -> str:
    """Return the first names: those with another namespace, then those of the same, then the others."""
    above, _, last = wanted.rpartition("/")
    names = sorted(names, key=lambda name: (name.rpartition("/")[2] != last, name.rpartition("/")[0] != above, name))
    more = f" and {len(names) - NAMED_AT_MOST} more" if len(names) > NAMED_AT_MOST else ""
    return f"{what} {', '.join(names[:NAMED_AT_MOST])}{more}" if names else f"no {what}"


def _lifecycle(node: Node, name: str, state: str, *, drive: bool) -> Lifecycle:
    made: Lifecycle = import_module("tfcompose.ros.lifecycle").Lifecycle(node, name, state, drive=drive)
    return made
