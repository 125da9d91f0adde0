"""Tables that are drawn again in their place, on a terminal of a test's own."""

import fcntl
import os
import pty
import struct
import termios
from collections.abc import Iterator
from typing import TextIO

import pyte
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tfcompose.cli.screen import LiveLines, Rows
from tfcompose.cli.terminal import can_redraw, plain

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

    def take_output(self) -> str:
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


def test_a_drawing_sends_the_lines_that_changed_and_what_was_below_it_goes(
    terminal: Terminal,
) -> None:
    lines = LiveLines(terminal.stream)
    lines.draw(["one", "two", "three"])
    assert terminal.take_output() == "\r\033[Kone\n\r\033[Ktwo\n\r\033[Kthree\n"
    lines.draw(["one", "2", "three"])
    assert terminal.take_output() == "\033[3A\n\r\033[K2\n\n"
    lines.draw(["one", "2", "three"])
    assert not terminal.take_output()
    lines.draw(["four"])
    assert terminal.take_output() == "\033[3A\r\033[Kfour\n\r\033[K\n\033[J\033[A"


ROWS = st.lists(st.sampled_from(["", "a", "\033[31mred\033[0m", "x" * 20]), min_size=1, max_size=6)


@given(st.lists(ROWS, max_size=5))
def test_a_terminal_shows_the_rows_of_the_last_drawing(drawings: list[list[str]]) -> None:
    screen = pyte.Screen(20, 6)
    stream, rows = pyte.Stream(screen), Rows()
    for drawing in drawings:
        stream.feed(rows.change(drawing).replace("\n", "\r\n"))
        screen_rows = [line.rstrip() for line in screen.display]
        assert screen_rows == [*map(plain, drawing), *[""] * (6 - len(drawing))]
        assert screen.cursor.y == len(drawing) - 1


def test_the_lines_fit_the_width_and_the_height_of_the_terminal(
    terminal: Terminal,
) -> None:
    LiveLines(terminal.stream).draw(["x" * 100, *map(str, range(50))])
    lines = terminal.take_output().replace("\r\033[K", "").split("\n")
    assert lines[0] == "x" * 38 + "…"
    assert (lines[8][:9], lines[8][38:]) == ("… 43 more", "…")
    assert len(lines) == 10


def test_after_the_window_shrank_the_screen_is_drawn_anew(terminal: Terminal) -> None:
    """Lines that were drawn have wrapped, so that nobody knows how many there are."""
    lines = LiveLines(terminal.stream)
    lines.draw(["x" * 30])
    terminal.take_output()
    terminal.resize(20, 10)
    lines.draw(["y" * 30])
    assert terminal.take_output() == "\033[H\033[2J\r\033[K" + "y" * 18 + "…\n"


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
