"""Keys of a terminal, by name."""

from __future__ import annotations

import re

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
        """Whether the input ends within a possible key.

        If no more input follows within a moment, ``end`` returns the keys so far.
        """
        return bool(self._rest)

    def feed(self, data: bytes) -> list[str]:
        """Return the completed keys."""
        text = self._rest + data.decode(errors="replace")
        begun = _BEGUN.search(text)
        self._rest = text[begun.start() :] if begun else ""
        return _keys(text[: len(text) - len(self._rest)])

    def end(self) -> list[str]:
        """Return the keys in the input if no more input follows."""
        text, self._rest = self._rest, ""
        return _keys(text)


def _keys(text: str) -> list[str]:
    return [_key_name(*match.groups()) for match in _KEY.finditer(text)]


def _key_name(sequence: str, char: str) -> str:
    """Return the name of a key; empty for an escape sequence that no key sends."""
    return _NAMED.get(sequence, "") if sequence else _NAMED.get(char, char)
