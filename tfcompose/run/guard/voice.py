"""How the guard speaks: to the launcher's pipe, or, without a launcher, to its own output."""

from __future__ import annotations

import os
import sys

from tfcompose.run.events import (
    EVENTS_FD,
    Clear,
    Complete,
    GateOpen,
    GateShut,
    GuardEvent,
    Live,
    OwnerReady,
    Remember,
    to_line,
)
from tfcompose.run.own import say

#: What a guard says that is switched off: it looks, and judges nobody.
_SEEN = (Clear, Live, OwnerReady, Complete, GateOpen, GateShut, Remember)


class Voice:
    """Takes events, and says those of one look at once, so that a guard that is killed has not told half of them."""

    def __init__(self, *, judges: bool) -> None:
        self._judges = judges
        self._said: list[str] = []
        self._pipe = int(os.environ[EVENTS_FD]) if EVENTS_FD in os.environ else None

    def emit(self, event: GuardEvent) -> None:
        """Take an event; a guard that judges nobody keeps what it finds to itself."""
        if not self._judges and not isinstance(event, _SEEN):
            return
        if self._pipe is not None:
            self._said.append(to_line(event))
        elif not isinstance(event, Remember):
            say(to_line(event).rstrip())

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
