"""The guard's process: it watches TF topics until a signal comes.

What it finds goes to the launcher as lines of JSON on the descriptor that ``TFCOMPOSE_EVENTS_FD`` names, and to its
own output where there is no launcher. ``TFCOMPOSE_SETTLE_S`` is how long it steps before the others are started.
"""

from __future__ import annotations

import os
import time
from typing import TYPE_CHECKING

from tfcompose.guard.channel import EventWriter, Memory, OrderReader, SilentEdges, SwitchMemory, recalled
from tfcompose.guard.diagnostics import DiagnosticsPage
from tfcompose.guard.gates import Gates, LifecycleDriver, Switches
from tfcompose.guard.judge import Judge
from tfcompose.guard.watch import CHECK_EVERY_S, TopicWatch, held_back, plans_by_topics, together
from tfcompose.ipc import JOINS, ORDERS_FD, REMAPPED, SETTLE
from tfcompose.plan.topics import GLOBAL, private_topics
from tfcompose.process import ready, say
from tfcompose.ros.clock import ClockWatch
from tfcompose.ros.graph import ids_say_who
from tfcompose.ros.node import open_node, wait
from tfcompose.text import counted

if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

    from rclpy.node import Node

    from tfcompose.ipc import GuardEvent
    from tfcompose.plan import Plan
    from tfcompose.process import Own
    from tfcompose.signals import Stop

    Topics = tuple[str, str]

DEFAULT_SETTLE_S = 0.5


def guard(own: Own, stop: Stop) -> None:
    """Watch /tf and /tf_static until a signal comes."""
    judges = own.plan.guard.mode != "off"
    plans = plans_by_topics(own.plan, own.process)
    events = EventWriter(judges=judges)
    emit = together(events.emit, list(plans.values()))
    left = recalled(os.environ)
    with open_node(own.node_name, own.namespace, args=own.ros_args) as node:
        if not ids_say_who(node):
            say("this rmw does not say with a message who sent it: findings name all who may have, where several may")
        watches = _watches(own, node, plans, emit, left)
        judged = [watch.judge for watch in watches]
        switches = Switches(node, own.plan, emit) if judges else None
        memories: list[Memory | SwitchMemory] = [
            Memory(" ".join(topics), watch.judge, watch.relay, events.emit)
            for topics, watch in zip(plans, watches, strict=True)
        ]
        if switches:
            memories.append(SwitchMemory(switches, events.emit, left))
        judging = "" if judges else ", and judging nobody"
        say(f"watching {counted(len(own.plan.edges), 'edge')}{judging}{' again' if left else ''}")
        events.flush()
        ready()
        diagnostics = DiagnosticsPage(node, own.plan.robot)
        steps = [OrderReader(judged, Gates(node, emit)).take, *(watch.step for watch in watches)]
        steps += [memory.hand_on for memory in memories]
        steps += [
            SilentEdges(judged, emit).report,
            events.heartbeat,
            events.flush,
            lambda: diagnostics.publish(judged, lambda: held_back(watches)),
        ]
        steps += [switches.check] if switches else []
        steps += [] if ORDERS_FD in os.environ else [LifecycleDriver(node, own.plan).check]
        steps += [ClockWatch(node, say, sim=own.plan.ros.clock == "sim").check, *(watch.report for watch in watches)]
        subscriptions = [each for watch in watches for each in watch.data.subscriptions]
        while not stop.requested:
            wait(node, subscriptions, CHECK_EVERY_S, stop)
            for step in steps:
                step()
        for watch in watches:
            watch.report(0.0)


def _watches(
    own: Own, node: Node, plans: dict[Topics, Plan], emit: Callable[[GuardEvent], None], left: dict[str, Any]
) -> list[TopicWatch]:
    """Return the watch over each pair of topics; one that follows another, or judges nobody, has begun."""
    judges, joins = own.plan.guard.mode != "off", bool(os.environ.get(JOINS))
    settle_s = float(os.environ.get(SETTLE, DEFAULT_SETTLE_S)) if judges and not joins else 0.0
    private = private_topics(own.plan) if REMAPPED in os.environ else None
    now = time.monotonic()
    says_who = ids_say_who(node)
    watches = []
    for topics, plan in plans.items():
        # One that judges nobody, or joins, takes every owner as the plan's, whenever it began.
        judge = Judge(plan, settle_s, now, 0 if joins or not judges else time.time_ns(), says_who=says_who)
        watches.append(TopicWatch(node, topics, judge, emit, _of(private, own.plan, topics)))
        if joins or not judges:
            watches[-1].begin(now, left.get(" ".join(topics)))
    if GLOBAL not in plans:
        watches[0].watch_global_topics()
    return watches


def _of(private: dict[str, Topics] | None, plan: Plan, topics: Topics) -> dict[str, Topics] | None:
    """Return the own topics of the processes that would send on these, where they are remapped."""
    if private is None:
        return None
    return {name: pair for name, pair in private.items() if plan.process(name).topics == topics}
