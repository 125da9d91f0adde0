"""What processes write, made harmless for a terminal: it cannot move the cursor, nor colour what follows."""

from __future__ import annotations

import re

from tfcompose.render.text import PLAIN

#: Control sequences (ECMA-48): those that end in m set colours, the others do something; and titles and links.
_SEQUENCE = re.compile(r"(\033\[[0-?]*[ -/]*[@-~]|\033\][^\033\a]*(?:\a|\033\\)?|\033[ -/]*[0-~])")
_COLOUR = re.compile(r"\033\[[0-9;:]*m")
#: A longer name does not move all lines to the right.
WIDEST = 24


def plain(text: str) -> str:
    """Return the text without control sequences; other characters that cannot be seen are marked."""
    return "".join(map(_marked, _SEQUENCE.split(text)[::2]))


def coloured_only(text: str) -> str:
    """Return the text with its colours, which end with it, and without other control sequences."""
    pieces = _SEQUENCE.split(text)
    if len(pieces) == 1:
        return _marked(text)
    colours = [piece if _COLOUR.fullmatch(piece) else "" for piece in pieces[1::2]]
    pieces[::2], pieces[1::2] = map(_marked, pieces[::2]), colours
    last = "".join(colours).rpartition("\033")[2]
    return "".join(pieces) + (PLAIN if last and f"\033{last}" != PLAIN else "")


def head_of(name: str, width: int) -> str:
    """Return what stands before each line of the process."""
    return f"{name:<{width}} |"


def width_of(names: list[str]) -> int:
    """Return how wide the names before lines are: as the longest, within bounds."""
    return min(max(map(len, names), default=0), WIDEST)


def _marked(text: str) -> str:
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() or c == "\t" else "\N{REPLACEMENT CHARACTER}" for c in text)
