"""The line below the log on a terminal: how many processes run, how many edges are live, and what is missing."""

from __future__ import annotations

import os
import time
from typing import TYPE_CHECKING

from tfcompose.run.launcher.notice import AllReady, Ended, FindingShown, OwnerLive, ProcessState, Stopping, TreeComplete

if TYPE_CHECKING:
    from collections.abc import Callable

    from tfcompose.plan import Plan
    from tfcompose.run.launcher.notice import Notice

#: The line is drawn at most so often, in seconds.
EVERY_S = 0.2


class Status:
    """Counts what notices say. ``columns`` gives the terminal's width."""

    def __init__(self, plan: Plan, columns: Callable[[], int], clock: Callable[[], float] = time.monotonic) -> None:
        self._owned = {process.name: len(process.owns) for process in plan.processes}
        self._edges = len(plan.edges)
        self._columns = columns
        self._clock = clock
        self._begun = clock()
        self._running: set[str] = set()
        self._live: dict[str, int] = {}
        self._findings = {"error": 0, "warning": 0}
        self._stopping = self._ready = self._ended = False
        self._shown = ""
        self._at = 0.0

    def take(self, notice: Notice) -> None:
        """Count what the notice says."""
        if isinstance(notice, ProcessState):
            alive = notice.state in ("RUNNING", "EXPECTED", "STOPPING")
            (self._running.add if alive else self._running.discard)(notice.process)
            if not alive:
                self._live.pop(notice.process, None)
        elif isinstance(notice, OwnerLive):
            self._live[notice.owner] = len(notice.edges)
        elif isinstance(notice, FindingShown):
            self._findings[notice.found.severity] += 1
        elif isinstance(notice, (AllReady, TreeComplete)):
            self._ready = True
        elif isinstance(notice, Stopping):
            self._stopping = True
        elif isinstance(notice, Ended):
            self._ended = True

    def cleared(self) -> str:
        """Return what takes the line away, so that others can be written in its place."""
        shown, self._shown = self._shown, ""
        return "\r\033[K" if shown else ""

    def drawn(self) -> str:
        """Return what draws the line anew; nothing where that would change nothing, or was done a moment ago."""
        text = "" if self._ended else self._text()
        now = self._clock()
        if text == self._shown or (self._shown and now - self._at < EVERY_S):
            return ""
        before, self._shown, self._at = self._shown, text, now
        return f"{chr(13)}\033[K{text}" if before else text

    def _text(self) -> str:
        seconds = int(self._clock() - self._begun)
        live = sum(self._live.values())
        parts = [f"{len(self._running)} of {len(self._owned)} processes", f"{live} of {self._edges} edges live"]
        parts += [f"{count} {what}{'s' * (count > 1)}" for what, count in self._findings.items() if count]
        waits = [name for name, owned in self._owned.items() if owned and name not in self._live]
        if self._stopping:
            parts.append("stopping")
        elif waits and not self._ready:
            parts.append(f"waiting for {', '.join(waits[:3])}{' …' * (len(waits) > 3)}")  # noqa: PLR2004 (what fits)
        text = f"[{seconds // 60:02d}:{seconds % 60:02d}] {' · '.join(parts)}"
        return text[: max(self._columns() - 1, 10)]


def columns_of(fd: int) -> int:
    """Return the width of the terminal behind the descriptor."""
    try:
        return os.get_terminal_size(fd).columns or 80
    except OSError:
        return 80
