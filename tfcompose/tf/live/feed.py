"""Feeds: sources of messages for the observers of TF trees.

A feed passes messages on pairs of topics (moving, fixed) to the observer of each pair. Sources are
ROS (``ros_feed``), Zenoh if ROS has no rmw_zenoh (``zenoh_feed``), and recordings (``tf.bags``).
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from collections.abc import Callable

    from typing_extensions import Self

    from tfcompose.foundation.signals import Stop

#: Maximum wait for messages in seconds, so that signals are handled in time.
WAIT_S = 0.1


class Feed(Protocol):
    """Passes messages to observers, within its ``with`` block."""

    def __enter__(self) -> Self:
        """Begin to listen, or raise RosError."""

    def __exit__(self, *_: object) -> None:
        """Stop listening."""

    def take(self, timeout_s: float, stop: Stop) -> bool:
        """Wait up to ``timeout_s`` seconds for messages, and pass them to the observers.

        Return whether more may come.

        Raises:
            RosError: if ROS cannot take messages.
            BagError: if a recording cannot be read.
        """

    def elsewhere(self) -> tuple[str, ...]:
        """Return the names of other topics with TF."""


def follow(
    feed: Feed,
    stop: Stop,
    *,
    duration_s: float | None = None,
    every_s: float = WAIT_S,
    show: Callable[[], object] | None = None,
) -> float:
    """Read from a feed for a time, or until ``stop`` is requested or the feed ends.

    Call ``show`` every ``every_s`` seconds. Return the duration of the observation in seconds.

    Raises:
        RosError: if ROS cannot receive messages.
        BagError: if a recording cannot be read.
    """
    begun = time.monotonic()  # on a slow machine, starting may take seconds
    end = float("inf") if duration_s is None else begun + duration_s
    due = begun + every_s
    while not stop.requested and (now := time.monotonic()) < end:
        if not feed.take(max(0.0, min(WAIT_S, end - now, due - now)), stop):
            return time.monotonic() - begun
        if time.monotonic() >= due:
            due = time.monotonic() + every_s
            if show is not None:
                show()
    feed.take(WAIT_S, stop)  # messages that arrived while this process was suspended
    return time.monotonic() - begun
