"""Names of the keys of a terminal."""

from __future__ import annotations

import re

#: Keys by their byte sequences, in the forms of several terminals.
_NAMED = {
    "A": "up",
    "B": "down",
    "C": "right",
    "D": "left",
    "H": "home",
    "F": "end",
    "Z": "backtab",
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
    "\t": "tab",
    " ": "pgdn",
    "\f": "redraw",
}
_KEY = re.compile(r"\033[\[O]([0-9;]*[~A-Za-z])|([^\033]|\033)", re.DOTALL)
_BEGUN = re.compile(r"\033(?:[\[O][0-9;]*)?\Z")


class KeyDecoder:
    """Decodes bytes from a terminal into names of keys."""

    def __init__(self) -> None:
        self._rest = ""

    @property
    def waits(self) -> bool:
        """Whether the input ends inside a possible key.

        If no further input follows within a moment, call ``end`` for the keys so far.
        """
        return bool(self._rest)

    def feed(self, data: bytes) -> list[str]:
        """Add input, and return the keys that are complete."""
        text = self._rest + data.decode(errors="replace")
        begun = _BEGUN.search(text)
        self._rest = text[begun.start() :] if begun else ""
        return _keys(text[: len(text) - len(self._rest)])

    def end(self) -> list[str]:
        """Return the remaining keys, because no more input follows."""
        text, self._rest = self._rest, ""
        return _keys(text)


def _keys(text: str) -> list[str]:
    return [_key_name(*match.groups()) for match in _KEY.finditer(text)]


def _key_name(sequence: str, char: str) -> str:
    """Return the name of a key; empty if no key sends the escape sequence."""
    return _NAMED.get(sequence, "") if sequence else _NAMED.get(char, char)
