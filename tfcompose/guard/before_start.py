"""Observation before a plan starts, and publishers that were there already."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from tfcompose.tf.live.publishers import FEWEST_GAPS

if TYPE_CHECKING:
    from tfcompose.tf.live.publishers import MessageCounter

#: For how long after the start a publisher can turn out to have been there first, and by how much
#: it must have been.
FIRST_S = 15.0
FIRST_BY_NS = 500_000_000
#: Maximum wait for messages whose sequence number tells when a publisher began, in seconds.
COUNTING_S = 0.7


@dataclass(slots=True)
class StartTime:
    """The observation before the start."""

    #: In monotonic seconds.
    begun: float
    #: In nanoseconds of the system clock.
    begun_ns: int
    #: When it ended, in monotonic seconds; None: it goes on.
    cleared: float | None = None
    #: When it ended, in nanoseconds of the system clock.
    cleared_ns: int = 0

    def clear(self, now: float) -> None:
        """Note that the observation is over."""
        self.cleared = now
        self.cleared_ns = self.begun_ns + int((now - self.begun) * 1e9)

    def may_show_first(self, sender: MessageCounter | None, now: float) -> bool:
        """Return whether further messages can show if the publisher was there before the start."""
        if sender is None or self.cleared is None or now - self.cleared > FIRST_S:
            return False
        began_before = sender.began_before(self.cleared_ns - FIRST_BY_NS)
        return began_before is None and now - sender.first_received < COUNTING_S

    def was_first(self, sender: MessageCounter | None, now: float) -> bool:
        """Return whether the publisher is known to have been there before the start."""
        if self.cleared is None:
            return True
        if sender is None or now - self.cleared >= FIRST_S:
            return False
        return bool(sender.began_before(self.cleared_ns - FIRST_BY_NS, FEWEST_GAPS))
