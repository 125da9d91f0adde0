"""The terminal of a live view.

Its other screen, keys as they are pressed, and how everything is put back.
"""

from __future__ import annotations

import contextlib
import re
import sys
import termios
from io import StringIO
from typing import TYPE_CHECKING

from rich.console import Console, ConsoleDimensions
from rich.live import Live
from rich.text import Text

from tfcompose.cli.terminal import coloured, size_of

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import TracebackType

    from typing_extensions import Self

    from tfcompose.launcher.output import NonBlockingOutput

#: Keys that send more than one byte, in the forms that terminals use.
_NAMED = {
    "A": "up",
    "B": "down",
    "C": "right",
    "D": "left",
    "H": "home",
    "F": "end",
    "1~": "home",
    "4~": "end",
    "7~": "home",
    "8~": "end",
    "5~": "pgup",
    "6~": "pgdn",
    "\r": "enter",
    "\n": "enter",
    "\033": "esc",
    "\x7f": "backspace",
    "\b": "backspace",
    " ": "pgdn",
}
_KEY = re.compile(r"\033[\[O]([0-9;]*[~A-Za-z])|([^\033]|\033)", re.DOTALL)
_BEGUN = re.compile(r"\033(?:[\[O][0-9;]*)?\Z")


class KeyDecoder:
    """Bytes of a terminal into the names of keys."""

    def __init__(self) -> None:
        self._rest = ""

    @property
    def waits(self) -> bool:
        """Whether a key has begun that may go on.

        After a moment without more, ``end`` says what it was.
        """
        return bool(self._rest)

    def feed(self, data: bytes) -> list[str]:
        """Return the keys that are complete."""
        text = self._rest + data.decode(errors="replace")
        begun = _BEGUN.search(text)
        self._rest = text[begun.start() :] if begun else ""
        return _keys(text[: len(text) - len(self._rest)])

    def end(self) -> list[str]:
        """Return the keys in what came, as nothing followed."""
        text, self._rest = self._rest, ""
        return _keys(text)


def _keys(text: str) -> list[str]:
    return [_key_name(*match.groups()) for match in _KEY.finditer(text)]


def _key_name(sequence: str, char: str) -> str:
    """Return the name of a key; an escape sequence that no key sends has none."""
    return _NAMED.get(sequence, "") if sequence else _NAMED.get(char, char)


class _Stream(StringIO):
    """A text stream for rich, which writes what it is given to the output when it is flushed."""

    def __init__(self, output: NonBlockingOutput) -> None:
        super().__init__()
        self._output = output

    def flush(self) -> None:
        text = self.getvalue()
        self.seek(0)
        self.truncate()
        if text:
            self._output.write(text)


class Screen:
    """A terminal whose other screen is drawn on, from the ``with`` block's begin to its end.

    Ctrl-C and Ctrl-Z remain signals; Ctrl-S is a key like others. A terminal that takes nothing is
    not waited for. What cannot be written since the terminal has gone raises OSError.
    """

    def __init__(self, keys_fd: int, output: NonBlockingOutput) -> None:
        self.fd = keys_fd
        self.output = output
        self._before = termios.tcgetattr(keys_fd)
        self._live: Live | None = None

    def __enter__(self) -> Self:
        self.enter()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.leave()

    def enter(self) -> None:
        """Go to the other screen, and take keys without Enter and without showing them."""
        settings = termios.tcgetattr(self.fd)
        settings[0] &= ~termios.IXON
        settings[3] &= ~(termios.ICANON | termios.ECHO)
        settings[6][termios.VMIN], settings[6][termios.VTIME] = 1, 0
        termios.tcsetattr(
            self.fd, termios.TCSANOW, settings
        )  # the others wait until the terminal has taken all
        stream = _Stream(self.output)
        console = Console(
            file=stream, force_terminal=True, no_color=not coloured(sys.stdout), highlight=False
        )
        self._live = Live(
            console=console,
            screen=True,
            auto_refresh=False,
            redirect_stdout=False,
            redirect_stderr=False,
        )
        console.size = ConsoleDimensions(*size_of(sys.stdout.fileno()))
        self._live.start()

    def leave(self) -> None:
        """Put the terminal back to what it was; one that has gone needs nothing."""
        live, self._live = self._live, None
        if live is None:
            return
        with contextlib.suppress(OSError):
            live.stop()
        self.output.finish()
        with contextlib.suppress(termios.error):
            termios.tcsetattr(self.fd, termios.TCSANOW, self._before)

    def draw(self, lines: Callable[[int, int], list[Text]]) -> bool:
        """Draw the lines returned for this size, unless the terminal is still busy."""
        if self._live is None:
            return True
        if self.output.owes:
            return False
        size = size_of(sys.stdout.fileno())
        self._live.console.size = ConsoleDimensions(*size)
        self._live.update(Text("\n").join(lines(*size)), refresh=True)
        return True
