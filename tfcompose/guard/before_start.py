"""Observation before a plan starts, and publishers that were already present then."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from tfcompose.tf.live.publishers import FEWEST_GAPS

if TYPE_CHECKING:
    from tfcompose.tf.live.publishers import MessageCounter

#: For this long after the start, messages can show that a publisher was present before it, by at
#: least the second value; in seconds and nanoseconds.
FIRST_S = 15.0
FIRST_BY_NS = 500_000_000
#: Maximum time to wait for messages whose sequence numbers show when a publisher began, in s.
COUNTING_S = 0.7


@dataclass(slots=True)
class StartTime:
    """The begin and the end of the observation before the start."""

    #: Begin of the observation, in monotonic seconds.
    begun: float
    #: Begin of the observation, in nanoseconds of the system clock.
    begun_ns: int
    #: End of the observation, in monotonic seconds; None while it continues.
    cleared: float | None = None
    #: End of the observation, in nanoseconds of the system clock.
    cleared_ns: int = 0

    def clear(self, now: float) -> None:
        """Record the end of the observation."""
        self.cleared = now
        self.cleared_ns = self.begun_ns + int((now - self.begun) * 1e9)

    def may_show_first(self, sender: MessageCounter | None, now: float) -> bool:
        """Return whether further messages can show that the publisher preceded the start."""
        if sender is None or self.cleared is None or now - self.cleared > FIRST_S:
            return False
        began_before = sender.began_before(self.cleared_ns - FIRST_BY_NS)
        return began_before is None and now - sender.first_received < COUNTING_S

    def was_first(self, sender: MessageCounter | None, now: float) -> bool:
        """Return whether the publisher is known to have been present before the start."""
        if self.cleared is None:
            return True
        if sender is None or now - self.cleared >= FIRST_S:
            return False
        return bool(sender.began_before(self.cleared_ns - FIRST_BY_NS, FEWEST_GAPS))
