"""The live pose of one frame in another."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

from tfcompose.observe.buffer import Buffer, TransformException
from tfcompose.ros.decoder import Decoder
from tfcompose.ros.node import open_node
from tfcompose.ros.tf import TFSubscription, wait

if TYPE_CHECKING:
    from collections.abc import Callable

    from tfcompose.pose import Pose
    from tfcompose.ros.stop import Stop


@dataclass(frozen=True, slots=True)
class Asked:
    """What to echo: the pose of ``b`` in ``a``; once, or ``rate`` times a second; ``timeout_s`` without one ends it."""

    a: str
    b: str
    once: bool
    rate: float
    timeout_s: float
    namespace: str


@dataclass(frozen=True, slots=True)
class Missed:
    """Why there was no pose."""

    reason: str


def echo(asked: Asked, say: Callable[[Pose, int | None], None], stop: Stop) -> Missed | None:
    """Give each pose, with its time in nanoseconds (None: all edges are fixed), to ``say``.

    A pose whose time is that of the last one is not new and not given again. Return None after one pose with ``once``,
    or when ``stop`` is requested; else why there was no new one for so long.
    """
    buffer, decoder = Buffer(), Decoder()
    prefix = f"/{asked.namespace.strip('/')}" if asked.namespace else ""
    with open_node("tfcompose_echo", asked.namespace.strip("/")) as node:
        topics = [(True, f"{prefix}/tf_static"), (False, f"{prefix}/tf")]
        subscriptions = [(TFSubscription(node, static=static, topic=topic), static) for static, topic in topics]
        begun = last = time.monotonic()
        next_at, messages, reason = begun, 0, ""
        said_ns: int | None = None
        while not stop.requested:
            wait(node, [subscription for subscription, _ in subscriptions], 0.05, stop)
            messages += sum(
                _take(buffer, decoder, subscription, static=static) for subscription, static in subscriptions
            )
            now = time.monotonic()
            if now < next_at:
                continue
            try:
                pose, stamp_ns = buffer.latest(asked.a, asked.b)
            except TransformException as error:
                reason = str(error)
            else:
                if stamp_ns is None or stamp_ns != said_ns:
                    say(pose, stamp_ns)
                    if asked.once:
                        return None
                    said_ns, last, next_at = stamp_ns, now, now + 1 / asked.rate
                    continue
                reason = f"nothing new came on {buffer.behind(asked.a, asked.b)} for {now - last:.1f} s"
            if now - last > asked.timeout_s:
                return Missed(_why(reason, messages, now - begun))
    return None


def _take(buffer: Buffer, decoder: Decoder, subscription: TFSubscription, *, static: bool) -> int:
    count = 0
    for received in subscription.take():
        count += 1
        try:
            buffer.insert(decoder.rows(received.data), static=static)
        except ValueError:
            continue
    return count


def _why(reason: str, messages: int, seconds: float) -> str:
    if messages:
        return reason
    return (
        f"no TF message came for {seconds:.1f} s; is the robot running, "
        "and with the same ROS_DOMAIN_ID and discovery range?"
    )
