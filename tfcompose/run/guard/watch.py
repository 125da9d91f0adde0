"""What the guard's process does: it feeds the judge with messages, the graph and the time, and passes on its events."""

from __future__ import annotations

import os
import time
from typing import TYPE_CHECKING

from tfcompose.ipc import JOINS, ORDERS_FD, REMAPPED, SETTLE
from tfcompose.plan.topics import GLOBAL, private_topics
from tfcompose.ros.graph import ids_say_who
from tfcompose.ros.node import open_node, wait
from tfcompose.run.clock_watch import ClockWatch
from tfcompose.run.guard.bulletin import Bulletin
from tfcompose.run.guard.eyes import LOOK_EVERY_S, Eyes, held_back
from tfcompose.run.guard.gatekeeper import Gates
from tfcompose.run.guard.heeding import Orders
from tfcompose.run.guard.judge import Judge
from tfcompose.run.guard.memory import Memory, SwitchMemory, recalled
from tfcompose.run.guard.quiet import Quiet
from tfcompose.run.guard.switches import Switches
from tfcompose.run.guard.topics import plans_by_topics, together
from tfcompose.run.guard.unattended import Unattended
from tfcompose.run.guard.voice import Voice
from tfcompose.run.notify import ready
from tfcompose.run.own import say

if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

    from rclpy.node import Node

    from tfcompose.ipc import GuardEvent
    from tfcompose.plan import Plan
    from tfcompose.ros.stop import Stop
    from tfcompose.run.own import Own

    Topics = tuple[str, str]

DEFAULT_SETTLE_S = 0.5


def guard(own: Own, stop: Stop) -> None:
    """Watch /tf and /tf_static until a signal comes."""
    judges = own.plan.guard.mode != "off"
    plans = plans_by_topics(own.plan, own.process)
    voice = Voice(judges=judges)
    emit = together(voice.emit, list(plans.values()))
    left = recalled(os.environ)
    with open_node(own.node_name, own.namespace, args=own.ros_args) as node:
        if not ids_say_who(node):
            say("this rmw does not say with a message who sent it: findings name all who may have, where several may")
        watches = _watches(own, node, plans, emit, left)
        judged = [watch.judge for watch in watches]
        switches = Switches(node, own.plan, emit) if judges else None
        memories: list[Memory | SwitchMemory] = [
            Memory(" ".join(topics), watch.judge, watch.relay, voice.emit)
            for topics, watch in zip(plans, watches, strict=True)
        ]
        if switches:
            memories.append(SwitchMemory(switches, voice.emit, left))
        say(f"watching {_counted(own.plan)}{'' if judges else ', and judging nobody'}{' again' if left else ''}")
        voice.flush()
        ready()
        bulletin = Bulletin(node, own.plan.robot)
        looks = [Orders(judged, Gates(node, emit)).take, *(watch.look for watch in watches)]
        looks += [memory.look for memory in memories]
        looks += [
            Quiet(judged, emit).look,
            voice.pulse,
            voice.flush,
            lambda: bulletin.look(judged, lambda: held_back(watches)),
        ]
        looks += [switches.look] if switches else []
        looks += [] if ORDERS_FD in os.environ else [Unattended(node, own.plan).look]
        looks += [ClockWatch(own, node).look, *(watch.report for watch in watches)]
        subscriptions = [each for watch in watches for each in watch.ear.subscriptions]
        while not stop.requested:
            wait(node, subscriptions, LOOK_EVERY_S, stop)
            for look in looks:
                look()
        for watch in watches:
            watch.report(0.0)


def _watches(
    own: Own, node: Node, plans: dict[Topics, Plan], emit: Callable[[GuardEvent], None], left: dict[str, Any]
) -> list[Eyes]:
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
        watches.append(Eyes(node, topics, judge, emit, _of(private, own.plan, topics)))
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


def _counted(plan: Plan) -> str:
    return f"{len(plan.edges)} edge{'s' if len(plan.edges) != 1 else ''}"
