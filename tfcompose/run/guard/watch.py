"""What the guard's process does: it feeds the judge with messages, the graph and the time, and passes on its events."""

from __future__ import annotations

import os
import time
from typing import TYPE_CHECKING

from tfcompose.ros.clock import SimClock
from tfcompose.ros.node import open_node
from tfcompose.ros.tf import TFSubscription, wait
from tfcompose.run.clock_watch import ClockWatch
from tfcompose.run.guard.bulletin import Bulletin
from tfcompose.run.guard.gatekeeper import Gates
from tfcompose.run.guard.hearing import Hearing
from tfcompose.run.guard.heeding import Orders
from tfcompose.run.guard.judge import FINDING_S, Judge
from tfcompose.run.guard.memory import Memory, recalled
from tfcompose.run.guard.neighbours import GLOBAL, Graph
from tfcompose.run.guard.relay import Relay
from tfcompose.run.guard.switches import Switches
from tfcompose.run.guard.topics import plans_by_topics, together
from tfcompose.run.guard.voice import Voice
from tfcompose.run.notify import ready
from tfcompose.run.orders import JOINS
from tfcompose.run.own import say
from tfcompose.verdict.poses import expected_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from typing import Any

    from rclpy.node import Node

    from tfcompose.plan import Plan
    from tfcompose.ros.stop import Stop
    from tfcompose.ros.tf import Received
    from tfcompose.run.events import GuardEvent
    from tfcompose.run.own import Own

SETTLE = "TFCOMPOSE_SETTLE_S"
DEFAULT_SETTLE_S = 1.0
LOOK_EVERY_S = 0.1
#: How often a strict guard says what it held back, in seconds.
REPORT_EVERY_S = 10.0


def guard(own: Own, stop: Stop) -> None:
    """Watch /tf and /tf_static until a signal comes."""
    judges = own.plan.guard.mode != "off"
    joins = bool(os.environ.get(JOINS))
    settle_s = float(os.environ.get(SETTLE, DEFAULT_SETTLE_S)) if judges and not joins else 0.0
    plans = plans_by_topics(own.plan, own.process)
    voice = Voice(judges=judges)
    emit = together(voice.emit, list(plans.values()))
    left = recalled(os.environ)
    with open_node(own.node_name, own.namespace, args=own.ros_args) as node:
        now = time.monotonic()
        watches = []
        for topics, plan in plans.items():
            # One that judges nobody, or joins, takes every owner as the plan's, whenever it began.
            judge = Judge(plan, settle_s, now, 0 if joins or not judges else time.time_ns())
            watches.append(_Watch(node, topics, judge, emit))
            if joins or not judges:
                watches[-1].begin(now, left.get(" ".join(topics)))
        if GLOBAL not in plans:
            watches[0].watch_global_topics()
        orders = Orders([watch.judge for watch in watches], Gates(node, emit))
        memories = [
            Memory(" ".join(topics), watch.judge, watch.relay, voice.emit)
            for topics, watch in zip(plans, watches, strict=True)
        ]
        say(f"watching {_counted(own.plan)}{'' if judges else ', and judging nobody'}{' again' if left else ''}")
        voice.flush()
        ready()
        clock = ClockWatch(own, node)
        bulletin = Bulletin(node, own.plan.robot)
        switches = Switches(node, own.plan, emit) if judges else None
        while not stop.requested:
            wait(node, [each for watch in watches for each in (watch.fixed, watch.moving)], LOOK_EVERY_S, stop)
            orders.take()
            for watch in watches:
                watch.look()
            for memory in memories:
                memory.look()
            voice.flush()
            bulletin.look([watch.judge for watch in watches], _held(watches))
            if switches:
                switches.look()
            clock.look()
            for watch in watches:
                watch.report()
        for watch in watches:
            watch.report(0.0)


class _Watch:
    """The judge's eyes and mouth."""

    def __init__(self, node: Node, topics: tuple[str, str], judge: Judge, emit: Callable[[GuardEvent], None]) -> None:
        self.moving = TFSubscription(node, static=False, topic=topics[0])
        self.fixed = TFSubscription(node, static=True, topic=topics[1])
        self._clock = SimClock(node) if judge.clocks.simulated else None
        self._hearing = Hearing(frozenset(expected_of(judge.plan)))
        self._graph = Graph(node, topics)
        self.relay = Relay(node, self._graph, judge.plan) if judge.plan.guard.mode == "strict" else None
        self._graph.look_for_own()
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
        received = list(self._received())
        now = time.monotonic()
        strangers = {each.gid for each, _ in received} - self._known
        self._known |= strangers
        if strangers:  # who sends once and goes is in the graph for a moment only
            self._look_round(now)
        if self._clock:
            self.judge.clock(self._clock.now_ns())
        for each, static in received:
            self._hear(each, now, static=static)
        if now >= self._due:
            self._due = now + LOOK_EVERY_S
            if not strangers:  # after the messages: what a strict guard passes on does not wait for it
                self._look_round(now)
            self._pass_on(self.judge.tick(now))
            if self._leaks_to:
                self._pass_on(self.judge.leaks(self._graph.global_writers(), self._leaks_to))

    def report(self, every_s: float = REPORT_EVERY_S) -> None:
        """Say now and then what was held back."""
        if self.relay and (not every_s or time.monotonic() >= self._report_due):
            self._report_due = time.monotonic() + every_s
            if held := self.relay.report():
                say(f"held back: {held}")

    def _received(self) -> Iterator[tuple[Received, bool]]:
        for subscription, static in ((self.fixed, True), (self.moving, False)):
            for each in subscription.take():
                if each.gid not in self._graph.own:
                    yield each, static

    def _hear(self, received: Received, now: float, *, static: bool) -> None:
        try:
            message = self._hearing.message(received, static=static)
        except ValueError as error:
            if received.gid not in self._malformed:
                self._malformed.add(received.gid)
                say(f"dropped a TF message: {error} (said once for each publisher)")
            return
        self._pass_on(self.judge.message(message, now))
        if self.relay:
            self.relay.pass_on(received, message, self.judge.admitted, self.judge.name_of(received.gid))

    def _look_round(self, now: float) -> None:
        """Take who publishes now; what waited for a name may pass."""
        writers = self._graph.writers()
        self._pass_on(self.judge.graph(writers, now))
        if self.relay:
            self.relay.forget({writer.gid for writer in writers}, now)
            waiting, self.relay.waiting = self.relay.waiting, []
            for received, message in waiting:
                admitted = self.judge.admits(message, now)
                self.relay.pass_on(received, message, admitted, self.judge.name_of(received.gid))

    def _pass_on(self, events: list[GuardEvent]) -> None:
        for event in events:
            self._emit(event)


def _held(watches: list[_Watch]) -> dict[tuple[str, str, str], int] | None:
    """Return what was held back, or None where nothing is."""
    relays = [watch.relay for watch in watches if watch.relay]
    return {key: count for relay in relays for key, count in relay.held_back.items()} if relays else None


def _counted(plan: Plan) -> str:
    return f"{len(plan.edges)} edge{'s' if len(plan.edges) != 1 else ''}"
