"""Checks that the guard makes on nodes: gates that the plan waits for, and switches.

Gates are topics, services, and the lifecycle states of nodes, which the guard may also drive.
Without a launcher, as in exported units and containers, the guard brings nodes into their states
by itself: again after a restart, but not after a user deactivated one.

Switches are parameters that the plan wrote for nodes; the guard reads them back. It asks each node
once after it appears, and again after it restarts. Drivers declare parameters late, once they have
found their device, so the guard asks for a missing one again, for a while.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

from tfcompose.foundation.text import list_names
from tfcompose.guard.judge import FINDING_S
from tfcompose.guard.verdict.drivers import not_taken
from tfcompose.model.messages import FindingShown, Gate, GateState
from tfcompose.tf.process import say
from tfcompose.tf.ros.graph import is_offered, services, writers

if TYPE_CHECKING:
    from collections.abc import Callable, Collection

    from rclpy.node import Node

    from tfcompose.model.messages import GuardEvent
    from tfcompose.model.plan import Driven, Plan
    from tfcompose.tf.ros.lifecycle import Lifecycle
    from tfcompose.tf.ros.parameters import ParameterReader, Value


#: Period between two checks of a gate, in seconds.
CHECK_EVERY_S = 0.2
#: And at a node that is in its state.
ASK_AGAIN_S = 2.0
NAMED_AT_MOST = 6


class Gates:
    """The gates that are not open yet."""

    def __init__(self, node: Node, emit: Callable[[GuardEvent], None]) -> None:
        self._node = node
        self._emit = emit
        self._gates: dict[str, Gate] = {}
        self._nodes: dict[tuple[str, str], Lifecycle] = {}
        self._reported: dict[str, str] = {}
        self._due = 0.0

    def add(self, gate: Gate) -> None:
        """Check this gate from now on."""
        self.forget(gate.process)
        if gate == Gate(gate.process):
            return
        self._gates[gate.process] = gate
        for name, state in gate.nodes.items():
            self._nodes[gate.process, name] = _lifecycle(self._node, name, state, drive=gate.drive)

    def forget(self, process: str) -> None:
        """Stop checking the process's gate."""
        self._gates.pop(process, None)
        self._reported.pop(process, None)
        for key in [key for key in self._nodes if key[0] == process]:
            self._nodes.pop(key).close()

    def check(self) -> None:
        """Check all gates that are due; report open ones and the state of the others."""
        now = time.monotonic()
        if not self._gates or now < self._due:
            return
        self._due = now + CHECK_EVERY_S
        for process, gate in list(self._gates.items()):
            is_open, observed = self._at(gate, now)
            if is_open:
                self.forget(process)
                self._emit(GateState(process, observed, is_open=True))
            elif self._reported.get(process) != observed:
                self._reported[process] = observed
                self._emit(GateState(process, observed, is_open=False))

    def _at(self, gate: Gate, now: float) -> tuple[bool, str]:
        states = [self._nodes[gate.process, name].check(now) for name in gate.nodes]
        if gate.topic:
            found = writers(self._node, gate.topic)
            observed = (
                f"{gate.topic} is published by {', '.join(writer.node for writer in found)}"
                if found
                else self._topics(gate.topic)
            )
            states.append((bool(found), observed))
        if gate.service:
            is_there = is_offered(self._node, gate.service)
            observed = (
                f"the service {gate.service} is there"
                if is_there
                else self._services(gate.service)
            )
            states.append((is_there, observed))
        for topic in gate.writers:
            names = ", ".join(writer.node for writer in writers(self._node, topic))
            states.append((False, f"{topic} is published by {names or 'no node'}"))
        return all(is_open for is_open, _ in states), "; ".join(observed for _, observed in states)

    def _topics(self, wanted: str) -> str:
        return _some(
            "topics", [name for name, _ in self._node.get_topic_names_and_types()], wanted
        )

    def _services(self, wanted: str) -> str:
        return _some("services", services(self._node), wanted)


@dataclass(slots=True)
class _DrivenNode:
    name: str
    node: Lifecycle
    due: float = 0.0
    reported: str = ""


class LifecycleDriver:
    """The plan's lifecycle nodes, driven without a launcher's orders."""

    def __init__(self, node: Node, plan: Plan) -> None:
        wanted = {
            name: state for process in plan.processes for name, state in process.lifecycle.items()
        }
        self._nodes = [
            _DrivenNode(name, _lifecycle(node, name, state, drive=True))
            for name, state in wanted.items()
        ]

    def check(self) -> None:
        """Advance each due node one transition, and print changes."""
        now = time.monotonic()
        for watched in self._nodes:
            if now < watched.due:
                continue
            is_there, observed = watched.node.check(now)
            watched.due = now + CHECK_EVERY_S
            if watched.node.answers and observed != watched.reported:
                watched.reported = observed
                say(observed)
            if is_there:
                watched.due = now + ASK_AGAIN_S
                watched.node.ask_again()


def _some(what: str, names: list[str], wanted: str) -> str:
    """Return the names in order: another namespace first, then the same, then the rest."""
    above, _, last = wanted.rpartition("/")
    names = sorted(
        names,
        key=lambda name: (name.rpartition("/")[2] != last, name.rpartition("/")[0] != above, name),
    )
    return f"{what} {list_names(names, NAMED_AT_MOST)}" if names else f"no {what}"


def _lifecycle(node: Node, name: str, state: str, *, drive: bool) -> Lifecycle:
    # Its messages are loaded where a node has states.
    from tfcompose.tf.ros.lifecycle import Lifecycle  # noqa: PLC0415

    return Lifecycle(node, name, state, drive=drive)


#: Period between two searches for nodes, in seconds.
_CHECK_SWITCHES_EVERY_S = 0.5
#: Time during which a parameter that the node lacks is requested again, and the period of these
#: requests, in seconds.
DECLARED_WITHIN_S = 20.0
AGAIN_EVERY_S = 2.0


@dataclass(slots=True)
class _NodeSwitches:
    """One node: the parameters in the plan, its sensors, and the state of the request."""

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
        self._node = node
        self._emit = emit
        self._due = self._finds_until = 0.0
        self._nodes: list[_NodeSwitches] = []
        self.follow(plan)

    def follow(self, plan: Plan) -> None:
        """Read a plan's switches from now on; nodes with the same switches continue."""
        before = {watched.node: watched for watched in self._nodes}
        self._nodes = []
        for process in plan.processes:
            for name, wanted in process.switches.items():
                known = before.get(name)
                if known and (known.wanted, known.drives) == (wanted, process.drives):
                    self._nodes.append(before.pop(name))
                    continue
                reader = _reader(self._node, name, tuple(wanted))
                self._nodes.append(_NodeSwitches(name, wanted, process.drives, reader))
        for gone in before.values():
            gone.reader.close()

    @property
    def answered(self) -> list[str]:
        """The nodes that have answered and have not left since."""
        return [watched.node for watched in self._nodes if watched.done]

    def recall(self, answered: Collection[str]) -> None:
        """Skip these nodes until they leave: they answered the previous guard.

        That includes nodes not discovered yet.
        """
        self._finds_until = time.monotonic() + FINDING_S
        for watched in self._nodes:
            watched.done = watched.node in answered

    def check(self) -> None:
        """Read answers and send due requests, without blocking."""
        now = time.monotonic()
        if not self._nodes or now < self._due:
            return
        self._due = now + _CHECK_SWITCHES_EVERY_S
        for watched in self._nodes:
            self._at(watched, now)

    def _at(self, watched: _NodeSwitches, now: float) -> None:
        if not watched.reader.is_there:
            watched.since, watched.done = None, watched.done and now < self._finds_until
            return
        if watched.done:
            return
        if watched.since is None:
            watched.since = watched.due = now
        found = watched.reader.take()
        if found is None:
            if now >= watched.due:
                watched.reader.ask(now)
        elif None in found.values() and now - watched.since < DECLARED_WITHIN_S:
            watched.due = now + AGAIN_EVERY_S
        else:
            watched.done = True
            for wrong in not_taken(watched.node, watched.wanted, found, watched.drives):
                self._emit(FindingShown(wrong))


def _reader(node: Node, name: str, parameters: tuple[str, ...]) -> ParameterReader:
    # Its services are loaded where one is read.
    from tfcompose.tf.ros.parameters import ParameterReader  # noqa: PLC0415

    return ParameterReader(node, name, parameters)
