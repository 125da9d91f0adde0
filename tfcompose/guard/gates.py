"""The guard's checks of nodes: gates, which the plan waits for, and switches.

Gates are topics, services, and lifecycle states of nodes. The guard can also bring nodes into
these states. Without a launcher, as in exported systemd units and containers, it does so by
itself, and again after a node restarts, but not after a user deactivated the node.

Switches are parameters that the plan sets on nodes. The guard reads them back. It asks each node
once after the node appears, and again after the node restarts. Some drivers declare parameters
only after they have found their device. So the guard repeats requests for a missing parameter for
a while.
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


#: Interval between checks of a gate, in seconds.
CHECK_EVERY_S = 0.2
#: Interval between requests to a node that is already in its state, in seconds.
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
        """Stop checking the gate of the process."""
        self._gates.pop(process, None)
        self._reported.pop(process, None)
        for key in [key for key in self._nodes if key[0] == process]:
            self._nodes.pop(key).close()

    def check(self) -> None:
        """Check all gates that are due. Report open gates, and the state of the other gates."""
        now = time.monotonic()
        if not self._gates or now < self._due:
            return
        self._due = now + CHECK_EVERY_S
        for process, gate in list(self._gates.items()):
            is_open, observed = self._observe_gate(gate, now)
            if is_open:
                self.forget(process)
                self._emit(GateState(process, observed, is_open=True))
            elif self._reported.get(process) != observed:
                self._reported[process] = observed
                self._emit(GateState(process, observed, is_open=False))

    def _observe_gate(self, gate: Gate, now: float) -> tuple[bool, str]:
        states = [self._nodes[gate.process, name].check(now) for name in gate.nodes]
        if gate.topic:
            publishers = writers(self._node, gate.topic)
            observed = (
                f"{gate.topic} is published by {', '.join(writer.node for writer in publishers)}"
                if publishers
                else self._topics(gate.topic)
            )
            states.append((bool(publishers), observed))
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

    def _topics(self, name: str) -> str:
        return _some("topics", [name for name, _ in self._node.get_topic_names_and_types()], name)

    def _services(self, name: str) -> str:
        return _some("services", services(self._node), name)


@dataclass(slots=True)
class _DrivenNode:
    name: str
    node: Lifecycle
    due: float = 0.0
    reported: str = ""


class LifecycleDriver:
    """Brings the plan's lifecycle nodes into their states without orders of a launcher."""

    def __init__(self, node: Node, plan: Plan) -> None:
        states = {
            name: state for process in plan.processes for name, state in process.lifecycle.items()
        }
        self._nodes = [
            _DrivenNode(name, _lifecycle(node, name, state, drive=True))
            for name, state in states.items()
        ]

    def check(self) -> None:
        """Advance each due node by a transition, and print changes."""
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


def _some(what: str, names: list[str], name: str) -> str:
    """Return a text with the names.

    First come equal names in other namespaces, then names in the same namespace, then other names.
    """
    above, _, last = name.rpartition("/")
    names = sorted(
        names,
        key=lambda name: (name.rpartition("/")[2] != last, name.rpartition("/")[0] != above, name),
    )
    return f"{what} {list_names(names, NAMED_AT_MOST)}" if names else f"no {what}"


def _lifecycle(node: Node, name: str, state: str, *, drive: bool) -> Lifecycle:
    # Only lifecycle nodes need its message types.
    from tfcompose.tf.ros.lifecycle import Lifecycle  # noqa: PLC0415

    return Lifecycle(node, name, state, drive=drive)


#: Interval between searches for nodes, in seconds.
_CHECK_SWITCHES_EVERY_S = 0.5
#: Time for which requests for a missing parameter are repeated, and the interval of these
#: requests, in seconds.
DECLARED_WITHIN_S = 20.0
AGAIN_EVERY_S = 2.0


@dataclass(slots=True)
class _NodeSwitches:
    """A node: its parameters in the plan, its sensors, and the progress of the request."""

    node: str
    values: dict[str, Value]
    drives: tuple[Driven, ...]
    reader: ParameterReader
    since: float | None = None
    due: float = 0.0
    done: bool = False


class Switches:
    """The nodes whose switches the guard reads back."""

    def __init__(self, node: Node, plan: Plan, emit: Callable[[GuardEvent], None]) -> None:
        self._node = node
        self._emit = emit
        self._due = self._finds_until = 0.0
        self._nodes: list[_NodeSwitches] = []
        self.follow(plan)

    def follow(self, plan: Plan) -> None:
        """Read the switches of this plan from now on.

        Nodes with the same switches keep their state.
        """
        before = {watched.node: watched for watched in self._nodes}
        self._nodes = []
        for process in plan.processes:
            for name, switches in process.switches.items():
                earlier = before.get(name)
                if earlier and (earlier.values, earlier.drives) == (switches, process.drives):
                    self._nodes.append(before.pop(name))
                    continue
                reader = _reader(self._node, name, tuple(switches))
                self._nodes.append(_NodeSwitches(name, switches, process.drives, reader))
        for gone in before.values():
            gone.reader.close()

    @property
    def answered(self) -> list[str]:
        """The nodes that have answered and have not left since."""
        return [watched.node for watched in self._nodes if watched.done]

    def recall(self, answered: Collection[str]) -> None:
        """Skip these nodes until they leave, because they answered the previous guard.

        The nodes may not be discovered yet.
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
            self._check_node(watched, now)

    def _check_node(self, watched: _NodeSwitches, now: float) -> None:
        if not watched.reader.is_there:
            watched.since, watched.done = None, watched.done and now < self._finds_until
            return
        if watched.done:
            return
        if watched.since is None:
            watched.since = watched.due = now
        samples = watched.reader.take()
        if samples is None:
            if now >= watched.due:
                watched.reader.ask(now)
        elif None in samples.values() and now - watched.since < DECLARED_WITHIN_S:
            watched.due = now + AGAIN_EVERY_S
        else:
            watched.done = True
            for wrong in not_taken(watched.node, watched.values, samples, watched.drives):
                self._emit(FindingShown(wrong))


def _reader(node: Node, name: str, parameters: tuple[str, ...]) -> ParameterReader:
    # Only plans with switches need its service types.
    from tfcompose.tf.ros.parameters import ParameterReader  # noqa: PLC0415

    return ParameterReader(node, name, parameters)
