"""How the guard speaks: to the launcher's pipe, or, without a launcher, to its own output."""

from __future__ import annotations

import os
import select
import sys
import time

from tfcompose.ipc import (
    EVENTS_FD,
    GUARD_EVENTS,
    Alive,
    Clear,
    Complete,
    GateOpen,
    GateShut,
    GuardEvent,
    Live,
    OwnerReady,
    Remember,
    Silent,
)
from tfcompose.run.own import say

#: What a guard says that is switched off: it looks, and judges nobody.
_SEEN = (Alive, Clear, Live, OwnerReady, Complete, GateOpen, GateShut, Remember, Silent)


#: How often the launcher hears that the guard looks, in seconds.
ALIVE_EVERY_S = 1.0


class Voice:
    """Takes events, and says those of one look at once, so that a guard that is killed has not told half of them."""

    def __init__(self, *, judges: bool) -> None:
        self._judges = judges
        self._said: list[str] = []
        self._pipe = int(os.environ[EVENTS_FD]) if EVENTS_FD in os.environ else None
        self._alive_due = 0.0

    def emit(self, event: GuardEvent) -> None:
        """Take an event; a guard that judges nobody keeps what it finds to itself."""
        if not self._judges and not isinstance(event, _SEEN):
            return
        if self._pipe is not None:
            self._said.append(GUARD_EVENTS.line(event))
        elif not isinstance(event, (Remember, Silent)):
            say(GUARD_EVENTS.line(event).rstrip())

    def pulse(self) -> None:
        """Say from time to time that the guard looks; a launcher that does not listen is not waited for."""
        now = time.monotonic()
        if self._pipe is None or now < self._alive_due:
            return
        self._alive_due = now + ALIVE_EVERY_S
        if select.select([], [self._pipe], [], 0)[1]:
            self.emit(Alive())

    def flush(self) -> None:
        """Say what was taken."""
        if not self._said or self._pipe is None:
            return
        data = memoryview("".join(self._said).encode())
        self._said.clear()
        try:
            while data:
                data = data[os.write(self._pipe, data) :]
        except BrokenPipeError:
            sys.exit(1)  # the launcher is gone
