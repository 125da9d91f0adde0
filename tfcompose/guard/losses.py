"""Watches for messages that the guard itself loses, so that no owner is blamed for them.

If a burst of messages exceeds the buffers of the guard's sockets, the kernel drops messages.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from tfcompose.foundation.findings import Note, finding
from tfcompose.foundation.text import plural
from tfcompose.model.messages import FindingShown, RecoveredShown
from tfcompose.tf.ros.sockets import LIMIT, WANTED, LostDatagrams, buffer_limit, widen_buffers

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from tfcompose.foundation.findings import Finding
    from tfcompose.guard.judge import Judge
    from tfcompose.model.messages import GuardEvent

CHECK_EVERY_S = 0.1
#: The finding ends when no message was lost for this time, in seconds.
OVER_S = 10.0


class LossWatch:
    """Tells the judges when the guard has lost messages, and reports the loss once."""

    def __init__(self, judges: Sequence[Judge], emit: Callable[[GuardEvent], None]) -> None:
        self._judges, self._emit = judges, emit
        self._lost = LostDatagrams()
        self._due = self._over_at = 0.0
        self._wrong: list[Finding] = []

    def wrong(self) -> list[Finding]:
        """Return the open finding, if there is one."""
        return self._wrong

    def check(self) -> None:
        """Check for losses when due. Call this before the judges judge."""
        if (now := time.monotonic()) >= self._due:
            self._due = now + CHECK_EVERY_S
            self.take(self._lost.take(), now)

    def take(self, lost: int, now: float) -> None:
        """Process the number of datagrams lost since the last call."""
        if lost:
            self._over_at = now + OVER_S
            for judge in self._judges:
                judge.live.note_lost_messages(now)
            widen_buffers()  # the kernel's limit may be higher now
            if not self._wrong:
                self._wrong = [datagrams_lost(lost, buffer_limit())]
                self._emit(FindingShown(self._wrong[0]))
        elif self._wrong and now >= self._over_at:
            self._wrong = []
            self._emit(RecoveredShown(f"the guard has lost nothing for {OVER_S:g} s"))


def datagrams_lost(lost: int, limit: int | None) -> Finding:
    """Return the finding for lost datagrams. A socket buffer holds at most ``limit`` bytes."""
    message = (
        f"the guard itself lost {plural(lost, 'datagram')}: they arrived faster than it could"
        " read them"
    )
    note = Note("meanwhile no owner counts as silent or slow")
    if limit is None or limit < WANTED:
        now = f" from {limit:,} bytes" if limit is not None else ""
        advice = f"raise the socket buffer limit{now}: sudo sysctl -w {LIMIT}={WANTED}"
    else:
        advice = "give the guard more CPU time, or let publishers send at different moments"
    return finding("TF862", message, None, notes=[note], help=advice)
