"""The guard's ends of the pipes to and from the launcher: orders, events and memory.

Without a launcher there are no orders, and events go to the guard's standard output. The memory is
the state for a new guard that replaces a guard that died. The launcher stores it without reading
it. The environment variable ``model.variables.MEMORY_FD`` has the descriptor of a file that
contains the memory as a JSON object, with a key for each pair of TF topics.
"""

from __future__ import annotations

import os
import select
import sys
import time
from typing import TYPE_CHECKING, Any

import msgspec

from tfcompose.guard.liveness import MOST_NAMED
from tfcompose.model.messages import (
    GUARD_ORDERS,
    Absent,
    Alive,
    Clear,
    ComponentOrder,
    ComponentState,
    CurrentFindings,
    DescriptionOrder,
    DescriptionState,
    Gate,
    GateState,
    GuardEvent,
    Live,
    OwnerReady,
    Present,
    Remember,
    Reread,
    Silent,
    TreeComplete,
    line_of,
)
from tfcompose.model.variables import EVENTS_FD, MEMORY_FD, ORDERS_FD
from tfcompose.tf.process import say

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from tfcompose.foundation.findings import Finding
    from tfcompose.guard.components import Components
    from tfcompose.guard.descriptions import Descriptions
    from tfcompose.guard.gates import Gates, Switches
    from tfcompose.guard.judge import Judge
    from tfcompose.guard.relay import Relay

#: Events of a guard in mode ``off``, which observes but does not judge.
_OBSERVATIONS = (
    Alive,
    Clear,
    Live,
    OwnerReady,
    TreeComplete,
    GateState,
    Remember,
    Silent,
    ComponentState,
    DescriptionState,
)
#: Interval of the guard's signs of life to the launcher, in seconds.
ALIVE_EVERY_S = 1.0
#: Interval at which the guard sends current findings, in seconds, and their maximum number.
FINDINGS_EVERY_S = 0.5
MOST_FINDINGS = 100
#: Maximum length of a part of the memory, in characters. The launcher accepts no longer lines.
LONGEST = 900_000
#: Keys of the part of the memory that belongs to no pair of topics.
_SWITCHES, _ANSWERED = "switches", "answered"


class OrderReader:
    """Reads and executes the launcher's orders."""

    def __init__(
        self,
        judges: list[Judge],
        gates: Gates,
        components: Components,
        descriptions: Descriptions,
        reread: Callable[[str], None],
    ) -> None:
        self._judges = judges
        self._gates = gates
        self._components = components
        self._descriptions = descriptions
        self._reread = reread
        self._fd = int(os.environ[ORDERS_FD]) if ORDERS_FD in os.environ else None
        self._rest = b""
        if self._fd is not None:
            os.set_blocking(self._fd, False)

    def take(self) -> None:
        """Execute pending orders. Check gates, and components that are to be loaded."""
        for line in self._lines():
            match GUARD_ORDERS.decode(line):
                case Absent(process):
                    for judge in self._judges:
                        judge.absent(process)
                    self._gates.forget(process)
                    self._components.forget(process)
                    self._descriptions.forget(process)
                case Present(process):
                    for judge in self._judges:
                        judge.live.present(process)
                case Gate() as gate:
                    self._gates.add(gate)
                case ComponentOrder() as order:
                    self._components.take(order)
                case DescriptionOrder() as order:
                    self._descriptions.take(order)
                case Reread(file):
                    self._reread(file)
        self._gates.check()
        self._components.check()
        self._descriptions.check()

    def _lines(self) -> list[bytes]:
        try:
            data = os.read(self._fd, 64 * 1024) if self._fd is not None else b""
        except BlockingIOError:
            return []
        *lines, self._rest = (self._rest + data).split(b"\n")
        return lines


class EventWriter:
    """Writes the events of a cycle in a single call, so that no event is written in part."""

    def __init__(self, *, judges: bool) -> None:
        self._judges = judges
        self._lines: list[bytes] = []
        self._pipe = int(os.environ[EVENTS_FD]) if EVENTS_FD in os.environ else None
        self._alive_due = 0.0

    def emit(self, event: GuardEvent) -> None:
        """Queue an event. A guard in mode ``off`` drops findings."""
        if not self._judges and not isinstance(event, _OBSERVATIONS):
            return
        if self._pipe is not None:
            self._lines.append(line_of(event))
        elif not isinstance(event, (CurrentFindings, Remember, Silent)):
            say(line_of(event).decode().rstrip())

    def heartbeat(self) -> None:
        """Write a sign of life when it is due. Never block on a launcher that does not read."""
        now = time.monotonic()
        if self._pipe is None or now < self._alive_due:
            return
        self._alive_due = now + ALIVE_EVERY_S
        if select.select([], [self._pipe], [], 0)[1]:
            self.emit(Alive())

    def flush(self) -> None:
        """Write the queued events."""
        if not self._lines or self._pipe is None:
            return
        data = memoryview(b"".join(self._lines))
        self._lines.clear()
        try:
            while data:
                data = data[os.write(self._pipe, data) :]
        except BrokenPipeError:
            sys.exit(1)  # the launcher has ended


class SilentEdges:
    """Reports live edges that have fallen silent, and silent edges that arrive again.

    The launcher does not count silent edges as live.
    """

    def __init__(self, judges: Sequence[Judge], emit: Callable[[GuardEvent], None]) -> None:
        self._judges, self._emit = judges, emit
        self._changes = -1
        self._reported: list[str] = []

    def report(self) -> None:
        """Report changes."""
        changes = sum(judge.live.changes for judge in self._judges)
        if changes == self._changes:
            return
        self._changes = changes
        before, self._reported = (
            self._reported,
            [child for judge in self._judges for child in judge.live.silent()],
        )
        for children, compared, over in (
            (self._reported, before, False),
            (before, self._reported, True),
        ):
            new = sorted(set(children).difference(compared))
            for start in range(0, len(new), MOST_NAMED):
                self._emit(Silent(tuple(new[start : start + MOST_NAMED]), over=over))


class FindingsReport:
    """Sends the current findings to the launcher when they change."""

    def __init__(
        self, sources: Sequence[Callable[[], list[Finding]]], emit: Callable[[GuardEvent], None]
    ) -> None:
        self._sources, self._emit = sources, emit
        self._due = 0.0
        self._reported: tuple[Finding, ...] = ()

    def report(self) -> None:
        """Send the findings if they have changed and a report is due."""
        if time.monotonic() < self._due:
            return
        self._due = time.monotonic() + FINDINGS_EVERY_S
        findings = [finding for source in self._sources for finding in source()]
        worst = tuple(
            sorted(dict.fromkeys(findings), key=lambda finding: finding.severity)[:MOST_FINDINGS]
        )
        if worst != self._reported:
            self._reported = worst
            self._emit(CurrentFindings(worst))


def recall_memory(env: Mapping[str, str]) -> dict[str, Any]:
    """Return the state of the previous guard by topics; empty without a previous guard."""
    if MEMORY_FD not in env:
        return {}
    with os.fdopen(int(env[MEMORY_FD]), "rb") as file:
        left: dict[str, Any] = msgspec.json.decode(file.read())
    by_topics: dict[str, Any] = {}
    for key, value in left.items():
        topics, _, part = key.rpartition(" ")
        by_topics.setdefault(topics, {})[part] = value
    return by_topics


class Memory:
    """Sends the state of judge and relay to the launcher. A part is sent when it changes."""

    def __init__(
        self, topics: str, judge: Judge, relay: Relay | None, emit: Callable[[GuardEvent], None]
    ) -> None:
        self._topics = topics
        self._judge = judge
        self._relay = relay
        self._emit = emit
        self._mark: object = None
        self._left: dict[str, Any] = {}

    def hand_on(self) -> None:
        """Send changed state."""
        mark = (self._judge.mark, self._relay and self._relay.changes)
        if mark == self._mark:
            return
        self._mark = mark
        memory = msgspec.to_builtins(self._judge.memory()) | (
            self._relay.memory() if self._relay else {}
        )
        gone = dict.fromkeys(self._left.keys() - memory.keys())
        for part, value in (memory | gone).items():
            if self._left.get(part) != value and len(msgspec.json.encode(value)) < LONGEST:
                self._emit(Remember({f"{self._topics} {part}": value}))
        self._left = memory


class SwitchMemory:
    """Stores which nodes have answered for their switches, so that no request is repeated."""

    def __init__(
        self, switches: Switches, emit: Callable[[GuardEvent], None], left: Mapping[str, Any]
    ) -> None:
        self._switches = switches
        self._emit = emit
        self._left = left.get(_SWITCHES, {}).get(_ANSWERED, [])
        switches.recall(self._left)

    def hand_on(self) -> None:
        """Send changed state."""
        answered = self._switches.answered
        if answered != self._left:
            self._left = answered
            self._emit(Remember({f"{_SWITCHES} {_ANSWERED}": answered}))
