"""Which edges that were live are silent now: the launcher counts them out."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.ipc import Silent
from tfcompose.run.guard.liveness import MOST_NAMED

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from tfcompose.ipc import GuardEvent
    from tfcompose.run.guard.judge import Judge


class Quiet:
    """Says what became silent, and what is no longer."""

    def __init__(self, judges: Sequence[Judge], emit: Callable[[GuardEvent], None]) -> None:
        self._judges, self._emit = judges, emit
        self._changes = -1
        self._said: list[str] = []

    def look(self) -> None:
        """Say what is different."""
        changes = sum(judge.live.changes for judge in self._judges)
        if changes == self._changes:
            return
        self._changes = changes
        before, self._said = self._said, [child for judge in self._judges for child in judge.live.silent()]
        for children, others, over in ((self._said, before, False), (before, self._said, True)):
            new = sorted(set(children).difference(others))
            for start in range(0, len(new), MOST_NAMED):
                self._emit(Silent(tuple(new[start : start + MOST_NAMED]), over=over))
