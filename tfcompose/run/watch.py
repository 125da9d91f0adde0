"""What the guard's process does: it feeds the judge with messages, the graph and the time, and passes on its events."""

from __future__ import annotations

import os
import sys
import time
from typing import TYPE_CHECKING

from tfcompose.ros.graph import UNKNOWN_NODE, writers
from tfcompose.ros.message import decode
from tfcompose.ros.node import open_node, remappings
from tfcompose.ros.tf import TFSubscription, wait
from tfcompose.run.events import EVENTS_FD, to_line
from tfcompose.run.judge import Judge, Message, Writer
from tfcompose.run.own import say

if TYPE_CHECKING:
    from collections.abc import Callable

    from rclpy.node import Node

    from tfcompose.ros.stop import Stop
    from tfcompose.run.events import GuardEvent
    from tfcompose.run.own import Own

SETTLE = "TFCOMPOSE_SETTLE_S"
DEFAULT_SETTLE_S = 1.0
LOOK_EVERY_S = 0.1


def guard(own: Own, stop: Stop) -> None:
    """Watch /tf and /tf_static until a signal comes."""
    settle_s = float(os.environ.get(SETTLE, DEFAULT_SETTLE_S))
    emit = _emitter()
    with open_node(own.node_name, own.namespace, args=[*remappings(own.process.remap), *own.ros_args]) as node:
        moving, fixed = TFSubscription(node, static=False), TFSubscription(node, static=True)
        judge = Judge(own.plan, settle_s, time.monotonic(), time.time_ns())
        say(f"watching {len(own.plan.edges)} edges")
        looked = 0.0
        malformed: set[bytes | None] = set()
        while not stop.requested:
            wait(node, [moving, fixed], LOOK_EVERY_S, stop)
            for subscription, static in ((fixed, True), (moving, False)):
                for received in subscription.take():
                    try:
                        edges = [(_plain(t.parent), _plain(t.child)) for t in decode(received.data)]
                    except ValueError as error:
                        if received.gid not in malformed:
                            malformed.add(received.gid)
                            say(f"dropped a TF message: {error} (said once for each publisher)")
                        continue
                    message = Message(edges, static, received.gid, received.source_ns, received.sequence)
                    _pass_on(judge.message(message, time.monotonic()), emit)
            now = time.monotonic()
            if now - looked >= LOOK_EVERY_S:
                looked = now
                _pass_on(judge.graph(_writers(node, fixed, moving), now), emit)
                _pass_on(judge.tick(now), emit)


def _plain(frame: str) -> str:
    """Return the frame's name as tf2 takes it: without a leading slash."""
    return frame.removeprefix("/")


def _writers(node: Node, fixed: TFSubscription, moving: TFSubscription) -> list[Writer]:
    return [
        Writer(w.gid, None if w.node.endswith(UNKNOWN_NODE) else w.node, static, w.durability == "volatile")
        for subscription, static in ((fixed, True), (moving, False))
        for w in writers(node, subscription.subscription.topic_name)
    ]


def _pass_on(events: list[GuardEvent], emit: Callable[[GuardEvent], None]) -> None:
    for event in events:
        emit(event)


def _emitter() -> Callable[[GuardEvent], None]:
    """Return what takes an event: a writer to the launcher's pipe, or, without a launcher, to the output."""
    if EVENTS_FD not in os.environ:
        return lambda event: say(to_line(event).rstrip())
    pipe = os.fdopen(int(os.environ[EVENTS_FD]), "w", encoding="utf-8", buffering=1)

    def emit(event: GuardEvent) -> None:
        try:
            pipe.write(to_line(event))
        except BrokenPipeError:
            sys.exit(1)  # the launcher is gone

    return emit
