"""How a judge sees one pair of TF topics: it is fed with messages, the graph and the time, and its events passed on."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from tfcompose.ros.clock import SimClock
from tfcompose.run.guard.ear import Ear
from tfcompose.run.guard.feedback import Feedback
from tfcompose.run.guard.hearing import Hearing
from tfcompose.run.guard.judge import FINDING_S
from tfcompose.run.guard.neighbours import Graph
from tfcompose.run.guard.relay import Relay
from tfcompose.run.own import say
from tfcompose.verdict.poses import expected_of

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from typing import Any

    from rclpy.node import Node

    from tfcompose.ipc import GuardEvent
    from tfcompose.run.guard.ear import Heard
    from tfcompose.run.guard.judge import Judge

    Topics = tuple[str, str]

LOOK_EVERY_S = 0.1
#: How often a strict guard says what it held back, in seconds.
REPORT_EVERY_S = 10.0


class Eyes:
    """A judge's ears and eyes on a pair of topics (moving, fixed), and its mouth; and its hands, where it is strict.

    ``private`` are the topics that the plan's processes are remapped to, where they are.
    """

    def __init__(
        self,
        node: Node,
        topics: Topics,
        judge: Judge,
        emit: Callable[[GuardEvent], None],
        private: Mapping[str, Topics] | None = None,
    ) -> None:
        self.ear = Ear(node, topics, private or {})
        self._clock = SimClock(node) if judge.clocks.simulated else None
        self._hearing = Hearing(frozenset(expected_of(judge.plan)))
        self._graph = Graph(node, topics, None if private is None else tuple(private.values()))
        feedback = None if private is None else Feedback(node, private, self.ear.own)
        strict = judge.plan.guard.mode == "strict"
        self.relay = Relay(node, self._graph, judge.plan, self.ear.own, feedback) if strict else None
        self.judge = judge
        self._emit = emit
        self._leaks_to: tuple[str, str] | None = None
        self._due = self._report_due = 0.0
        self._malformed: set[bytes | None] = set()
        self._known: set[bytes | None] = set()

    def watch_global_topics(self) -> None:
        """Look for nodes of the plan on the global topics too, where they do not belong."""
        self._leaks_to = self._graph.topics

    def begin(self, now: float, memory: dict[str, Any] | None) -> None:
        """Look at nothing before the start: it was long ago, or is nobody's business."""
        self._pass_on(self.judge.tick(now) if memory is None else self.judge.recall(memory, now))
        if self.relay and memory:
            self.relay.recall(memory, lambda message: self.judge.admits(message, now), now + FINDING_S)

    def look(self) -> None:
        """Take what has come, and from time to time the graph."""
        heard = list(self.ear.take())
        now = time.monotonic()
        strangers = {each.received.gid for each in heard} - self._known
        self._known |= strangers
        if strangers:  # who sends once and goes is in the graph for a moment only
            self._look_round(now)
        if self._clock:
            self.judge.clock(self._clock.now_ns(), now)
        for each in heard:
            self._hear(each, now)
        if now >= self._due:
            self._due = now + LOOK_EVERY_S
            if not strangers:  # after the messages: what a strict guard passes on does not wait for it
                self._look_round(now)
            if self._clock:
                self.judge.clocks.sent = self._graph.sends_clock()
            self._pass_on(self.judge.tick(now))
            if self._leaks_to:
                self._pass_on(self.judge.leaks(self._graph.global_writers(), self._leaks_to))

    def report(self, every_s: float = REPORT_EVERY_S) -> None:
        """Say now and then what was held back."""
        if self.relay and (not every_s or time.monotonic() >= self._report_due):
            self._report_due = time.monotonic() + every_s
            if held := self.relay.held.report():
                say(f"held back: {held}")

    def _hear(self, heard: Heard, now: float) -> None:
        received = heard.received
        try:
            message = self._hearing.message(received, static=heard.static)
        except ValueError as error:
            if received.gid not in self._malformed:
                self._malformed.add(received.gid)
                say(f"dropped a TF message: {error} (said once for each publisher)")
            return
        self._pass_on(self.judge.message(message, now))
        if self.relay:
            self.relay.pass_on(heard, message, self.judge.admitted, self.judge.name_of(received.gid))

    def _look_round(self, now: float) -> None:
        """Take who publishes now; what waited for a name may pass."""
        writers = self._graph.writers()
        self._pass_on(self.judge.graph(writers, now))
        if self.relay:
            waiting, self.relay.waiting = self.relay.waiting, []
            for heard, message in waiting:
                admitted = self.judge.admits(message, now)
                self.relay.pass_on(heard, message, admitted, self.judge.name_of(heard.received.gid))
            self.relay.look(writers, now)

    def _pass_on(self, events: list[GuardEvent]) -> None:
        for event in events:
            self._emit(event)


def held_back(watches: list[Eyes]) -> dict[tuple[str, str, str], int] | None:
    """Return what was held back, or None where nothing is."""
    relays = [watch.relay for watch in watches if watch.relay]
    return {key: count for relay in relays for key, count in relay.held.counts.items()} if relays else None
