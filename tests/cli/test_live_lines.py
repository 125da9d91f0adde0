"""Tables that are drawn again in their place, on a terminal of a test's own."""

import fcntl
import os
import pty
import struct
import termios
from collections.abc import Iterator
from typing import TextIO

import pytest

from tfcompose.cli.tables import LiveLines
from tfcompose.cli.terminal import can_redraw

END = "<the end>"


class Terminal:
    """A pseudo-terminal; what is written to ``stream`` is read back by ``shown``."""

    def __init__(self) -> None:
        self._screen, line = pty.openpty()
        self.stream: TextIO = os.fdopen(line, "w")

    def resize(self, columns: int, rows: int) -> None:
        fcntl.ioctl(
            self.stream.fileno(), termios.TIOCSWINSZ, struct.pack("HHHH", rows, columns, 0, 0)
        )

    def shown(self) -> str:
        """Return what was written since the last time.

        It may come in pieces, so an end is written after it.
        """
        self.stream.write(END)
        self.stream.flush()
        came = b""
        while not came.endswith(END.encode()):
            came += os.read(self._screen, 1 << 16)
        return came.decode().removesuffix(END).replace("\r\n", "\n")

    def close(self) -> None:
        self.stream.close()
        os.close(self._screen)


@pytest.fixture
def terminal() -> Iterator[Terminal]:
    made = Terminal()
    made.resize(40, 10)
    yield made
    made.close()


def test_each_drawing_replaces_the_last_one_and_what_was_below_it_goes(terminal: Terminal) -> None:
    lines = LiveLines(terminal.stream)
    lines.draw(["one", "two", "three"])
    assert terminal.shown() == "one\033[K\ntwo\033[K\nthree\033[K\n\033[J"
    lines.draw(["four"])
    assert terminal.shown() == "\r\033[3Afour\033[K\n\033[J"


def test_no_line_is_longer_than_the_terminal_and_there_are_no_more_than_it_shows(
    terminal: Terminal,
) -> None:
    LiveLines(terminal.stream).draw(["x" * 100, *map(str, range(50))])
    lines = terminal.shown().replace("\033[K", "").split("\n")
    assert lines[0] == "x" * 38 + "…"
    assert (lines[8][:9], lines[8][38:]) == ("… 43 more", "…")
    assert len(lines) == 10


def test_after_the_window_shrank_the_screen_is_drawn_anew(terminal: Terminal) -> None:
    """Lines that were drawn have wrapped, so that nobody knows how many there are."""
    lines = LiveLines(terminal.stream)
    lines.draw(["x" * 30])
    terminal.shown()
    terminal.resize(20, 10)
    lines.draw(["y" * 30])
    assert terminal.shown() == "\033[H\033[2J" + "y" * 18 + "…\033[K\n\033[J"


def test_a_terminal_that_cannot_move_its_cursor_and_a_pipe_get_plain_lines(
    terminal: Terminal, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TERM", "xterm")
    assert can_redraw(terminal.stream)
    monkeypatch.setenv("TERM", "dumb")
    assert not can_redraw(terminal.stream)
    monkeypatch.setenv("TERM", "xterm")
    reader, writer = os.pipe()
    with os.fdopen(writer, "w") as pipe, os.fdopen(reader):
        assert not can_redraw(pipe)
