"""The joints whose states a publisher sends."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class SentJoints:
    """The joints that a publisher of joint states sent on a topic."""

    topic: str
    #: The publisher's full node name; empty while unknown.
    node: str
    joints: frozenset[str]
    #: Arrival of its first message, in nanoseconds of the system clock.
    first_ns: int = 0
    #: Arrival of its newest message, in nanoseconds of the system clock.
    last_ns: int = 0
