"""Start of a plan: the observation before it, and who published before that."""

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
#: How long messages are waited for whose count tells when a publisher began.
COUNTING_S = 0.7


@dataclass(slots=True)
class StartTime:
    """The observation before the start: monotonic seconds, and nanoseconds of the system's clock.

    It is over when it is ``cleared``.
    """

    begun: float
    begun_ns: int
    cleared: float | None = None
    cleared_ns: int = 0

    def clear(self, now: float) -> None:
        """Note that the observation is over."""
        self.cleared = now
        self.cleared_ns = self.begun_ns + int((now - self.begun) * 1e9)

    def may_show_first(self, sender: MessageCounter | None, now: float) -> bool:
        """Return whether more messages can tell if the publisher was there before the start."""
        if sender is None or self.cleared is None or now - self.cleared > FIRST_S:
            return False
        began_before = sender.began_before(self.cleared_ns - FIRST_BY_NS)
        return began_before is None and now - sender.first_received < COUNTING_S

    def was_first(self, sender: MessageCounter | None, now: float) -> bool:
        """Return whether the publisher was there before the start, as far as is known."""
        if self.cleared is None:
            return True
        if sender is None or now - self.cleared >= FIRST_S:
            return False
        return bool(sender.began_before(self.cleared_ns - FIRST_BY_NS, FEWEST_GAPS))
