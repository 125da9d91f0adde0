"""Lifecycles where no launcher gives orders: in units and containers the guard brings nodes into their states.

A node that was started again is brought there again; one that somebody deactivated stays so.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING

from tfcompose.run.own import say

if TYPE_CHECKING:
    from rclpy.node import Node

    from tfcompose.plan import Plan
    from tfcompose.ros.lifecycle import Lifecycle

#: How often a node is looked at on its way, and when it is there, in seconds.
LOOK_EVERY_S = 0.2
ASK_AGAIN_S = 2.0


@dataclass(slots=True)
class _Driven:
    name: str
    node: Lifecycle
    due: float = 0.0
    said: str = ""


class Unattended:
    """The plan's lifecycle nodes, and where each is."""

    def __init__(self, node: Node, plan: Plan) -> None:
        wanted = {name: state for process in plan.processes for name, state in process.lifecycle.items()}
        self._nodes = [_Driven(name, _lifecycle(node, name, state)) for name, state in wanted.items()]

    def look(self) -> None:
        """Go on with each node that is due, and say what has changed of it."""
        now = time.monotonic()
        for one in self._nodes:
            if now < one.due:
                continue
            is_there, seen = one.node.look(now)
            one.due = now + LOOK_EVERY_S
            if one.node.answers and seen != one.said:
                one.said = seen
                say(seen)
            if is_there:
                one.due = now + ASK_AGAIN_S
                one.node.ask_again()


def _lifecycle(node: Node, name: str, state: str) -> Lifecycle:
    made: Lifecycle = import_module("tfcompose.ros.lifecycle").Lifecycle(node, name, state, drive=True)
    return made
