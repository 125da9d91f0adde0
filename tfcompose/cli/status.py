"""The line below the log on a terminal: how many processes run, how many edges are live, and what is missing."""

from __future__ import annotations

import os
import time
from typing import TYPE_CHECKING

from tfcompose.ipc import AllReady, Ended, FindingShown, OwnerLive, ProcessState, Stopping, TreeComplete

if TYPE_CHECKING:
    from collections.abc import Callable

    from tfcompose.ipc import Notice
    from tfcompose.plan import Plan

#: The line is drawn at most so often, in seconds.
EVERY_S = 0.2
#: Columns that stay free: the terminal writes ``^C`` there, and must not begin a new line.
FREE = 3
NAMED_AT_MOST = 3
_CLEAR = "\r\033[K"


class Status:
    """Counts what notices say. ``columns`` gives the terminal's width."""

    def __init__(self, plan: Plan, columns: Callable[[], int], clock: Callable[[], float] = time.monotonic) -> None:
        self._owned = {process.name: len(process.owns) for process in plan.processes}
        self._edges = len(plan.edges)
        self._columns = columns
        self._clock = clock
        self._begun = clock()
        self._states: dict[str, str] = {}
        self._live: dict[str, int] = {}
        self._findings = {"error": 0, "warning": 0}
        self._stopping = self._ready = self._ended = self._drawn = False
        self._shown = ""
        self._at = 0.0

    def take(self, notice: Notice) -> None:
        """Count what the notice says."""
        if isinstance(notice, ProcessState):
            self._states[notice.process] = notice.state
            if notice.state not in ("RUNNING", "EXPECTED", "STOPPING"):
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
        self._shown = ""
        return _CLEAR if self._drawn else ""

    def drawn(self) -> str:
        """Return what draws the line anew; nothing where that would change nothing, or was done a moment ago."""
        text = "" if self._ended else self._fitting(max(self._columns() - FREE, 1))
        now = self._clock()
        if text == self._shown or (self._shown and now - self._at < EVERY_S):
            return ""
        before, self._shown, self._at, self._drawn = self._shown, text, now, True
        return f"{_CLEAR}{text}" if before else text

    def _fitting(self, columns: int) -> str:
        """Return the longest way to say it that fits."""
        seconds = int(self._clock() - self._begun)
        clock = f"[{seconds // 60:02d}:{seconds % 60:02d}]"
        long, short = self._parts("processes", "edges live", " of "), self._parts("proc", "edges", "/")
        for parts in (long, long[:-1], short, short[:-1]):
            text = f"{clock} {' · '.join(part for part in parts if part)}"
            if len(text) <= columns:
                return text
        return text if len(text) <= columns else f"{text[: columns - 1]}…"

    def _parts(self, processes: str, edges: str, of: str) -> list[str]:
        """Return what is wrong, how many processes run, how many edges are live, and what is missing."""
        wrong = [f"{count} {what}{'s' * (count > 1)}" for what, count in self._findings.items() if count]
        running = sum(self._runs(name) for name in self._owned)
        counted = [f"{running}{of}{len(self._owned)} {processes}"]
        counted += [f"{sum(self._live.values())}{of}{self._edges} {edges}"] if self._edges else []
        return [*wrong, *counted, self._missing()]

    def _runs(self, name: str) -> bool:
        """Return whether the process runs; one that others start does when its edges are live, as far as is known."""
        state = self._states.get(name)
        return state in ("RUNNING", "STOPPING") or (
            state == "EXPECTED" and (not self._owned[name] or name in self._live)
        )

    def _missing(self) -> str:
        if self._stopping:
            alive = [name for name, state in self._states.items() if state in ("RUNNING", "STOPPING")]
            return f"stopping {_named(alive)}" if alive else "stopping"
        waits = [name for name, owned in self._owned.items() if owned and name not in self._live]
        return f"waiting for {_named(waits)}" if waits and not self._ready else ""


def _named(names: list[str]) -> str:
    more = f" and {len(names) - NAMED_AT_MOST} more" if len(names) > NAMED_AT_MOST else ""
    return f"{', '.join(names[:NAMED_AT_MOST])}{more}"


def columns_of(fd: int) -> int:
    """Return the width of the terminal behind the descriptor."""
    try:
        return os.get_terminal_size(fd).columns or 80
    except OSError:
        return 80
