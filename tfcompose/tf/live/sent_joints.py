"""The joints whose states somebody sends."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class SentJoints:
    """The joints that a publisher of joint states sent on a topic.

    ``node`` is its full name, empty while that is not known. ``first_ns`` and ``last_ns`` are when
    its first and newest message came, in nanoseconds of the system's clock.
    """

    topic: str
    node: str
    joints: frozenset[str]
    first_ns: int = 0
    last_ns: int = 0
