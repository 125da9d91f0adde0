"""Looks at the running tree for a while: a node, its subscriptions, and a census for each pair of TF topics."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from tfcompose.observe.elsewhere import tf_elsewhere
from tfcompose.observe.live import Live
from tfcompose.ros.graph import topics as topics_of
from tfcompose.ros.node import open_node

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from tfcompose.observe.census import Census
    from tfcompose.ros.stop import Stop

#: A wait for messages is not longer, so that what is shown is shown in time.
_WAIT_S = 0.1


def watch(  # noqa: PLR0913 (all but two are named)
    name: str,
    censuses: Mapping[tuple[str, str], Census],
    stop: Stop,
    *,
    duration_s: float | None,
    every_s: float = 1.0,
    show: Callable[[int], None] | None = None,
) -> tuple[float, tuple[str, ...]]:
    """Fill the censuses of the topics (moving, fixed) for so many seconds, or until ``stop`` is requested.

    ``show`` is called ``every_s`` with the time, in nanoseconds of the system's clock. The node's name is ``name``.
    Return for how many seconds it listened, and the names of other topics on which there is TF.

    Raises:
        RosError: if ROS cannot start a node, or take messages.
    """
    with open_node(name, "") as node:
        lives = [Live(node, census, topics) for topics, census in censuses.items()]
        begun = time.monotonic()  # a slow machine may take seconds until it listens
        end = None if duration_s is None else begun + duration_s
        due = begun + every_s
        while not stop.requested:
            now = time.monotonic()
            if end is not None and now >= end:
                break
            for live in lives:
                live.look(_WAIT_S / len(lives) if end is None else min(_WAIT_S / len(lives), max(0.0, end - now)), stop)
            if show is not None and time.monotonic() >= due:
                due = time.monotonic() + every_s
                show(time.time_ns())
        for live in lives:
            live.look(0.0, stop)  # what came while this process was kept from looking
        elsewhere = tf_elsewhere(topics_of(node), [topic for pair in censuses for topic in pair])
        return time.monotonic() - begun, elsewhere
