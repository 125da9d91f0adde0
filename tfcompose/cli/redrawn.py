"""Lines on a terminal that are drawn again in their place, without flicker."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import TextIO

_ESCAPE = "\033["


def can_redraw(stream: TextIO) -> bool:
    """Return whether lines can be drawn again there: it is a terminal, and one that moves its cursor."""
    return stream.isatty() and os.environ.get("TERM", "dumb") != "dumb"


class Redrawn:
    """Some lines at the end of a terminal's output; each drawing replaces the last one."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self._drawn = 0
        self._columns = 0

    @property
    def width(self) -> int:
        """The terminal's width in characters."""
        return self._size()[0]

    def draw(self, lines: Sequence[str]) -> None:
        """Draw the lines where the last ones were; those that the terminal has no room for are counted only."""
        columns, rows = self._size()
        room = max(rows - 1, 2)
        shown = list(lines)
        if len(shown) > room:
            shown = [*shown[: room - 1], f"… {len(shown) - room + 1} more; a larger window shows them, or a pipe"]
        up = f"\r{_ESCAPE}{self._drawn}A" if self._drawn else ""
        if columns < self._columns:  # what was drawn takes more lines now, and how many is the terminal's secret
            up = f"{_ESCAPE}H{_ESCAPE}2J"
        body = "".join(f"{_cut(line, columns - 1)}{_ESCAPE}K\n" for line in shown)
        self._stream.write(f"{up}{body}{_ESCAPE}J")  # what was below the last line goes
        self._stream.flush()
        self._drawn, self._columns = len(shown), columns

    def _size(self) -> tuple[int, int]:
        try:
            size = os.get_terminal_size(self._stream.fileno())
        except OSError:
            return 80, 24
        return size.columns or 80, size.lines or 24


def _cut(line: str, columns: int) -> str:
    return line if len(line) <= columns else f"{line[: columns - 1]}…"
