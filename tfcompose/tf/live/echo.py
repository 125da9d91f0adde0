"""Live poses of a frame in another frame."""

from __future__ import annotations

import time
from functools import partial
from typing import TYPE_CHECKING

from tfcompose.tf.live.flood import EdgeBounds, ReadingTime
from tfcompose.tf.live.pose_query import NoPose
from tfcompose.tf.live.ros_feed import tf_elsewhere
from tfcompose.tf.live.topics import TFTopics
from tfcompose.tf.ros.clock import SimClock
from tfcompose.tf.ros.graph import topics
from tfcompose.tf.ros.node import open_node, wait
from tfcompose.tf.ros.tf_codec import Decoder
from tfcompose.tf.tf2 import Buffer, TransformException
from tfcompose.tf.tf2.exceptions import Rejection

if TYPE_CHECKING:
    from tfcompose.foundation.signals import Stop
    from tfcompose.tf.live.pose_query import OnPose, PoseQuery
    from tfcompose.tf.live.topics import TFData

TOO_EARLY = (
    "echo hears the tree from its own start on; for an earlier time read a recording: --bag"
)


def echo(query: PoseQuery, on_pose: OnPose, stop: Stop) -> NoPose | None:
    """Pass poses of the live tree to ``on_pose`` as they arrive.

    A pose with the time of the previous pose is skipped. Return None after a pose with ``once``,
    or when ``stop`` is requested. Otherwise, return the reason why no new pose arrived within the
    timeout.
    """
    listened = _Listened(query)
    with open_node("tfcompose_echo", "") as node:
        data, clock, decoder = TFTopics(node, query.topics), SimClock(node), Decoder()
        reading = ReadingTime(decoder)
        begun = last = next_at = time.monotonic()
        given_ns: int | None = None
        while not stop.requested:
            wait(node, data.readers, 0.05, stop)
            clock_ns = clock.now_ns()  # first, so that no pose from before a clock jump follows it
            for each in data.take():
                read = partial(listened.take, decoder, each)
                reading.read(each.received, read, listened.bounds.floods, time.monotonic())
            listened.follow(clock_ns)
            now = time.monotonic()
            if now < next_at:
                continue
            try:
                pose, stamp_ns = query.pose_in(listened.buffer)
            except TransformException as error:
                reason = str(error.detail)
            else:
                if stamp_ns is None or stamp_ns != given_ns:
                    on_pose(pose, stamp_ns)
                    if query.once or query.at_ns > 0:
                        return None
                    given_ns, last, next_at = stamp_ns, now, now + 1 / query.rate
                    continue
                behind = listened.buffer.behind(query.target, query.source)
                reason = f"nothing new came on {behind} for {now - last:.1f} s"
            if now - last > query.timeout_s:
                if listened.messages:
                    return listened.explain_missing(reason)
                return NoPose(
                    f"no TF message came for {now - begun:.1f} s",
                    elsewhere=tf_elsewhere(topics(node), query.topics),
                )
    return None


class _Listened:
    """Received messages, and the reasons for missing poses."""

    def __init__(self, query: PoseQuery) -> None:
        self.buffer = Buffer()
        self.bounds = EdgeBounds()
        self.messages = 0
        self._query = query
        self._clock_ns = 0
        self._rejected: tuple[str, Rejection] | None = None

    def take(self, decoder: Decoder, data: TFData) -> None:
        self.messages += 1
        try:
            rows = self.bounds.keep_rows(decoder.rows(data.received.data), data.received.gid)
            rejected = self.buffer.insert(rows, static=data.static)
        except ValueError:
            return
        self._rejected = next(iter(rejected), self._rejected)

    def follow(self, clock_ns: int | None) -> None:
        """Drop moving edges when simulated time jumps back, as tf2's buffers do."""
        if clock_ns is not None and clock_ns < self._clock_ns:
            self.buffer.clear()
            self._rejected = None
        self._clock_ns = clock_ns or self._clock_ns

    def explain_missing(self, reason: str) -> NoPose:
        """Return the reason for the missing pose, with its explanation."""
        if beyond := sum(self.bounds.beyond.values()):
            reason += (
                f"; {beyond} transforms of further frames came, of publishers that send too many"
            )
        advice = TOO_EARLY if self._query.at_ns > 0 and "into the past" in reason else ""
        if self._rejected is None:
            return NoPose(reason, advice)
        child, why = self._rejected
        if why is Rejection.OLD:
            reason += (
                f"; what came for {child} was too old to be taken: did a bag or a simulation start"
                " again?"
            )
        elif child not in self.buffer.frames:  # none of its transforms was accepted
            reason += f"; what came for {child or 'a frame without name'} was rejected: {why.text}"
        return NoPose(reason, advice)
