"""Says once that simulated time does not come: without it a plan with ``ros.clock: sim`` stands still in silence."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from tfcompose.ros.clock import SimClock
from tfcompose.ros.graph import writers
from tfcompose.run.own import say

if TYPE_CHECKING:
    from rclpy.node import Node

    from tfcompose.run.own import Own

CLOCK_AFTER_S = 5.0


class ClockWatch:
    """Looks for the first message on /clock, if the plan's time is simulated; ``check`` costs nothing afterwards."""

    def __init__(self, own: Own, node: Node) -> None:
        self._node = node
        self._due = time.monotonic() + CLOCK_AFTER_S
        self._clock = SimClock(node) if own.plan.ros.clock == "sim" else None

    def check(self) -> None:
        """Say after some seconds that nothing has come, and who should have sent it."""
        if self._clock is None or (self._clock.now_ns() is None and time.monotonic() < self._due):
            return
        if self._clock.now_ns() is None:
            say(no_clock(self._node))
        self._node.destroy_subscription(self._clock.subscription.subscription)
        self._clock = None


def no_clock(node: Node) -> str:
    """Return the sentence that no simulated time has come, with who publishes it."""
    names = sorted({writer.node for writer in writers(node, "/clock")})
    who = f"{', '.join(names)} publishes it and has sent nothing" if names else "nobody publishes it"
    return f"no time on /clock after {CLOCK_AFTER_S:g} s: the plan's clock is sim, and {who}"
