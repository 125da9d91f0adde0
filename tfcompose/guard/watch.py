"""One pair of TF topics: messages, the graph and the time go to a judge, and its events are passed on.

Robots beside each other on topics of their own have one guard, and one judge for each pair of topics: what one owner
may publish on its robot's topics is a violation on another's, so each pair is judged alone.
"""

from __future__ import annotations

import os
import time
from dataclasses import replace
from typing import TYPE_CHECKING

from tfcompose.guard.judge import FINDING_S
from tfcompose.guard.relay import Feedback, Relay
from tfcompose.ipc import PROCESS, RUN_ID, Clear, Complete
from tfcompose.live.messages import MessageReader
from tfcompose.live.topics import TFGraph, TFTopics
from tfcompose.plan.topics import parts_of
from tfcompose.process import say
from tfcompose.ros.clock import SimClock
from tfcompose.verdict.drivers import expected_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence
    from typing import Any

    from rclpy.node import Node

    from tfcompose.guard.judge import Judge
    from tfcompose.ipc import GuardEvent
    from tfcompose.live.topics import TFData
    from tfcompose.plan import Plan, PlanProcess

    Topics = tuple[str, str]

CHECK_EVERY_S = 0.1
#: How often a strict guard says what it held back, in seconds.
REPORT_EVERY_S = 10.0


class TopicWatch:
    """Feeds a judge with a pair of topics (moving, fixed); where the plan is strict, passes on what is admitted.

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
        self.data = TFTopics(node, topics, private, deep=True)
        self._clock = SimClock(node) if judge.clocks.simulated else None
        self._reader = MessageReader(frozenset(expected_of(judge.plan)))
        self._graph = TFGraph(
            node,
            topics,
            None if private is None else tuple(private.values()),
            run=f"{RUN_ID}={os.environ[RUN_ID]}" if RUN_ID in os.environ else "",
            process_variable=PROCESS,
        )
        feedback = None if private is None else Feedback(node, private, self.data.own)
        strict = judge.plan.guard.mode == "strict"
        self.relay = Relay(node, self._graph, judge.plan, self.data.own, feedback) if strict else None
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

    def step(self) -> None:
        """Take what has come, and from time to time the graph."""
        taken = list(self._taken())
        now = time.monotonic()
        strangers = {each.received.gid for each in taken} - self._known
        self._known |= strangers
        if strangers:  # who sends once and goes is in the graph for a moment only
            self._ask_graph(now)
        if self._clock:
            self.judge.clock(self._clock.now_ns(), now)
        for each in taken:
            self._take(each, now)
        if now >= self._due:
            self._due = now + CHECK_EVERY_S
            if not strangers:  # after the messages: what a strict guard passes on does not wait for it
                self._ask_graph(now)
            if self._clock:
                self.judge.clocks.sent = self._graph.sends_clock()
            self._pass_on(self.judge.tick(now))
            if self._leaks_to:
                self._pass_on(self.judge.leaks(self._graph.global_publishers(), self._leaks_to))

    def report(self, every_s: float = REPORT_EVERY_S) -> None:
        """Say now and then what was held back."""
        if self.relay and (not every_s or time.monotonic() >= self._report_due):
            self._report_due = time.monotonic() + every_s
            if held := self.relay.held.report():
                say(f"held back: {held}")

    def _taken(self) -> Iterator[TFData]:
        """Yield what has come; the id that it has instead stands for a sender where the rmw does not say who sent."""
        for data in self.data.take():
            received = data.received
            yield data if received.gid else replace(data, received=replace(received, gid=received.raw_gid))

    def _take(self, data: TFData, now: float) -> None:
        received = data.received
        try:
            message = self._reader.read(received, static=data.static)
        except ValueError as error:
            if received.gid not in self._malformed:
                self._malformed.add(received.gid)
                say(f"dropped a TF message: {error} (reported once for each publisher)")
            return
        self._pass_on(self.judge.message(message, now))
        if self.relay:
            self.relay.pass_on(data, message, self.judge.admitted, self.judge.name_of(received.gid))

    def _ask_graph(self, now: float) -> None:
        """Take who publishes now; what waited for a name may pass."""
        publishers = self._graph.publishers()
        self._pass_on(self.judge.graph(publishers, now))
        if self.relay:
            waiting, self.relay.waiting = self.relay.waiting, []
            for data, message in waiting:
                admitted = self.judge.admits(message, now)
                self.relay.pass_on(data, message, admitted, self.judge.name_of(data.received.gid))
            self.relay.update(publishers, now)

    def _pass_on(self, events: list[GuardEvent]) -> None:
        for event in events:
            self._emit(event)


def held_back(watches: list[TopicWatch]) -> dict[tuple[str, str, str], int] | None:
    """Return what was held back, or None where nothing is."""
    relays = [watch.relay for watch in watches if watch.relay]
    return {key: count for relay in relays for key, count in relay.held.counts.items()} if relays else None


def plans_by_topics(plan: Plan, guard: PlanProcess) -> dict[Topics, Plan]:
    """Return, for each pair of topics (moving, fixed) that owners publish on, the plan with the edges on these.

    The guard's own topics are always among them.
    """
    parts = parts_of(plan)
    own = parts.pop(guard.topics, None) or replace(plan, edges=())
    return {guard.topics: own, **parts}


def together(emit: Callable[[GuardEvent], None], plans: Sequence[Plan]) -> Callable[[GuardEvent], None]:
    """Return what passes on the events of the judges of these plans.

    That all is clear, and that the tree is complete, is reported once: when the last judge has said so.
    """
    waiting = {Clear: len(plans), Complete: sum(bool(plan.edges) for plan in plans)}

    def passed_on(event: GuardEvent) -> None:
        if isinstance(event, Complete):
            waiting[Complete] -= event.edges > 0
            if waiting[Complete] == 0 and event.edges:
                emit(Complete(sum(len(plan.edges) for plan in plans)))
            return
        if isinstance(event, Clear):
            waiting[Clear] -= 1
            if waiting[Clear]:
                return
        emit(event)

    return passed_on
