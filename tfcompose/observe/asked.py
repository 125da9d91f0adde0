"""What echo is asked, and why it has no answer."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Asked:
    """What to echo: the pose of ``b`` in ``a``; once, or ``rate`` times a second; ``timeout_s`` without one ends it.

    ``at_ns`` is the time of the pose, in nanoseconds since the epoch; from 0 down it is counted from the newest.
    """

    a: str
    b: str
    once: bool
    rate: float
    timeout_s: float
    namespace: str
    at_ns: int = 0


@dataclass(frozen=True, slots=True)
class Missed:
    """Why there was no pose, and what to do about it, where more is known than the reason says."""

    reason: str
    help: str = ""
