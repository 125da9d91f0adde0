"""Screen that redraws only its changed rows in place on a terminal.

If a few rows change 20 times a second, only these rows are sent over a slow link, not the screen.
"""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import termios
from typing import TYPE_CHECKING

from tfcompose.cli.tables import shorten
from tfcompose.cli.terminal import CLEAR, CLEAR_LINE, plain, size_of

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from typing import TextIO

    from typing_extensions import Self

    from tfcompose.launcher.output import NonBlockingOutput

#: Clears the rows below the cursor's row.
_CLEAR_BELOW = "\n\033[J\033[A"
#: Switches to the alternate screen without a cursor, and back: xterm's modes 1049 and 25.
_OTHER_SCREEN = "\033[?1049h\033[?25l"
_OWN_SCREEN = "\033[?25h\033[?1049l"


class Rows:
    """Rows of text that are redrawn in place.

    Between drawings, the cursor is on the last row.
    """

    def __init__(self) -> None:
        self._drawn: list[str] = []

    def forget(self) -> None:
        """Begin at the cursor's row, with empty rows below it."""
        self._drawn = []

    def change(self, rows: Sequence[str]) -> str:
        """Return the output that replaces the drawn rows by ``rows``."""
        before, self._drawn = self._drawn, list(rows)
        if before == self._drawn:
            return ""
        up = f"\033[{len(before) - 1}A" if len(before) > 1 else ""
        kept = [*before, *[""] * (len(rows) - len(before))]
        lines = [""] * len(rows)
        for number, row in enumerate(rows):
            if row != kept[number]:  # clear first: text of full width would lose its end
                lines[number] = f"{CLEAR_LINE}{row}"
        below = _CLEAR_BELOW if len(rows) < len(before) else ""
        return up + "\n".join(lines) + below


class LiveLines:
    """Lines at the end of a terminal's output that the next drawing replaces."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self._rows = Rows()
        self._columns = 0

    def draw(self, lines: Sequence[str]) -> None:
        """Redraw the lines in place.

        If not all lines fit on the terminal, the last row tells the number of the missing lines.
        """
        columns, rows = size_of(self._stream.fileno())
        room = max(rows - 1, 2)
        drawn = list(lines)
        if len(drawn) > room:
            drawn = [
                *drawn[: room - 1],
                f"… {len(drawn) - room + 1} more; a larger window shows them, or a pipe",
            ]
        if columns < self._columns:
            # The terminal wraps the drawn lines now, and the number of rows that they fill is
            # unknown.
            self._stream.write(CLEAR)
            self._rows.forget()
        self._columns = columns
        fitted = [_fit_line(line, columns - 1) for line in drawn]
        self._stream.write(self._rows.change([*fitted, ""]))
        self._stream.flush()


def _fit_line(line: str, width: int) -> str:
    text = plain(line)
    return line if len(text) <= width else shorten(text, width, at_end=True)


class Screen:
    """The alternate screen of a terminal, during the ``with`` block.

    Ctrl-C and Ctrl-Z remain signals. Ctrl-S is an ordinary key. If the terminal accepts no output,
    the screen does not block. If the terminal is gone, the methods raise OSError.
    """

    def __init__(self, keys_fd: int, output: NonBlockingOutput) -> None:
        self.fd = keys_fd
        self.output = output
        self._before = termios.tcgetattr(keys_fd)
        self._rows = Rows()
        self._size = (0, 0)
        self._is_shown = False

    def __enter__(self) -> Self:
        self.enter()
        return self

    def __exit__(self, *_: object) -> None:
        self.leave()

    def enter(self) -> None:
        """Switch to the alternate screen; read keys without Enter and without echo."""
        settings = termios.tcgetattr(self.fd)
        settings[0] &= ~termios.IXON
        settings[3] &= ~(termios.ICANON | termios.ECHO)
        settings[6][termios.VMIN], settings[6][termios.VTIME] = 1, 0
        termios.tcsetattr(
            self.fd, termios.TCSANOW, settings
        )  # the other modes wait until the terminal has accepted all output
        self._is_shown = True
        self.output.write(_OTHER_SCREEN)
        self.redraw()

    def redraw(self) -> None:
        """Send all rows at the next drawing.

        Call this when other programs may have written to the terminal.
        """
        self._size = (0, 0)

    def leave(self) -> None:
        """Restore the terminal, unless it is gone."""
        if not self._is_shown:
            return
        self._is_shown = False
        with contextlib.suppress(OSError):
            self.output.write(_OWN_SCREEN)
        self.output.finish()
        with contextlib.suppress(termios.error):
            termios.tcsetattr(self.fd, termios.TCSANOW, self._before)

    def suspend(self) -> None:
        """Restore the terminal, stop this process as Ctrl-Z does, and come back with it."""
        self.leave()
        handler = signal.signal(signal.SIGTSTP, signal.SIG_DFL)
        os.kill(os.getpid(), signal.SIGTSTP)
        signal.signal(signal.SIGTSTP, handler)
        self.enter()

    def draw(self, rows: Callable[[int, int], list[str]]) -> bool:
        """Draw the rows for the current size. Return False if the terminal is still busy.

        ``rows`` returns the rows from columns and rows of the terminal.
        """
        if not self._is_shown:
            return True
        if self.output.owes:
            return False
        size = size_of(sys.stdout.fileno())
        if size != self._size:
            self._size = size
            self.output.write(CLEAR)
            self._rows.forget()
        self.output.write(self._rows.change(rows(*size)))
        return True
