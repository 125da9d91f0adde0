"""The live pose of one frame in another."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from tfcompose.observe.asked import Asked, Missed
from tfcompose.observe.elsewhere import advice, tf_elsewhere
from tfcompose.ros.clock import SimClock
from tfcompose.ros.graph import topics as topics_of
from tfcompose.ros.node import TFSubscription, open_node, wait
from tfcompose.ros.tf_codec import Decoder
from tfcompose.tf2 import Buffer, TransformException
from tfcompose.tf2.exceptions import Rejection

if TYPE_CHECKING:
    from collections.abc import Callable

    from tfcompose.geometry import Pose
    from tfcompose.ros.stop import Stop

TOO_EARLY = "echo hears the tree from its own start on; for a time before, look into a recording: --bag"


def echo(asked: Asked, say: Callable[[Pose, int | None], None], stop: Stop) -> Missed | None:
    """Give each pose, with its time in nanoseconds (None: all edges are fixed), to ``say``.

    A pose whose time is that of the last one is not new and not given again. Return None after one pose with ``once``,
    or when ``stop`` is requested; else why there was no new one for so long.
    """
    ear = _Ear(asked)
    prefix = f"/{asked.namespace.strip('/')}" if asked.namespace else ""
    with open_node("tfcompose_echo", asked.namespace.strip("/")) as node:
        topics = [(True, f"{prefix}/tf_static"), (False, f"{prefix}/tf")]
        subscriptions = [(TFSubscription(node, static=static, topic=topic), static) for static, topic in topics]
        clock = SimClock(node)
        begun = last = time.monotonic()
        next_at = begun
        said_ns: int | None = None
        while not stop.requested:
            wait(node, [subscription for subscription, _ in subscriptions], 0.05, stop)
            clock_ns = clock.now_ns()  # before what is taken, so that nothing of a time before the jump comes after it
            for subscription, static in subscriptions:
                ear.take(subscription, static=static)
            ear.follow(clock_ns)
            now = time.monotonic()
            if now < next_at:
                continue
            try:
                pose, stamp_ns = ear.pose()
            except TransformException as error:
                reason = str(error)
            else:
                if stamp_ns is None or stamp_ns != said_ns:
                    say(pose, stamp_ns)
                    if asked.once or asked.at_ns > 0:
                        return None
                    said_ns, last, next_at = stamp_ns, now, now + 1 / asked.rate
                    continue
                reason = f"nothing new came on {ear.buffer.behind(asked.a, asked.b)} for {now - last:.1f} s"
            if now - last > asked.timeout_s:
                if ear.messages:
                    return Missed(ear.why(reason), TOO_EARLY if asked.at_ns > 0 and "into the past" in reason else "")
                elsewhere = tf_elsewhere(topics_of(node), [topic for _, topic in topics])
                return Missed(f"no TF message came for {now - begun:.1f} s", advice(elsewhere))
    return None


class _Ear:
    """What was heard, and what follows from it."""

    def __init__(self, asked: Asked) -> None:
        self.buffer = Buffer()
        self._asked = asked
        self._decoder = Decoder()
        self.messages = 0
        self._clock_ns = 0
        self._refused: tuple[str, Rejection] | None = None

    def take(self, subscription: TFSubscription, *, static: bool) -> None:
        for received in subscription.take():
            self.messages += 1
            try:
                refused = self.buffer.insert(self._decoder.rows(received.data), static=static)
            except ValueError:
                continue
            self._refused = next(iter(refused), self._refused)

    def follow(self, clock_ns: int | None) -> None:
        """Forget all moving edges when simulated time goes back, as tf2's buffers do in nodes with use_sim_time."""
        if clock_ns is not None and clock_ns < self._clock_ns:
            self.buffer.clear()
            self._refused = None
        self._clock_ns = clock_ns or self._clock_ns

    def pose(self) -> tuple[Pose, int | None]:
        a, b, at_ns = self._asked.a, self._asked.b, self._asked.at_ns
        if at_ns > 0:
            return self.buffer.lookup(a, b, at_ns)
        pose, stamp_ns = self.buffer.latest(a, b)
        return self.buffer.lookup(a, b, stamp_ns + at_ns) if stamp_ns and at_ns else (pose, stamp_ns)

    def why(self, reason: str) -> str:
        """Return the reason with what explains it."""
        if self._refused is None:
            return reason
        child, why = self._refused
        if why is Rejection.OLD:
            return f"{reason}; what came for {child} was too old to be taken: did a bag or a simulation start again?"
        if child in self.buffer.frames:  # what came at other times was taken
            return reason
        return f"{reason}; what came for {child or 'a frame without name'} was refused: {why.text}"
