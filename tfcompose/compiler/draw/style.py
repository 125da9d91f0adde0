"""Colours, lines and fonts in one table, and widths of text.

The owners' colours come from the palette by Okabe and Ito, which colour-blind people can tell
apart. Each owner also has a number, for print without colour and for robots with more owners than
colours.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

from tfcompose.foundation.text import visible

SANS = "Arial, Helvetica, 'Liberation Sans', sans-serif"


@dataclass(frozen=True, slots=True)
class Style:
    """Colours, each as six hexadecimal digits for light and dark mode, and lengths in px.

    An empty colour means that nothing is drawn.
    """

    fill: tuple[str, str] = ("", "")
    stroke: tuple[str, str] = ("", "")
    width: float = 0.0
    dash: tuple[float, ...] = ()
    size: float = 0.0
    bold: bool = False


PAPER = ("ffffff", "14181d")
INK = ("1b1f24", "e8ebee")
SOFT = ("57606a", "a3adb8")

#: Colours of each owner: the line, the box, and text on the line, each for light and dark mode.
_OWNERS = (
    (
        ("66707c", "8d98a5"),
        ("f1f3f5", "242a31"),
        ("ffffff", "14181d"),
    ),  # grey: the first owner, usually ``static``, which owns most edges
    (("0072b2", "4ba3da"), ("e3f0f8", "152a3a"), ("ffffff", "14181d")),  # blue
    (("d55e00", "ef8235"), ("fbeadd", "38220f"), ("ffffff", "14181d")),  # vermilion
    (("008a64", "2bb58c"), ("e0f3ed", "10302a"), ("ffffff", "14181d")),  # green
    (("b8578c", "d98bb5"), ("f8e8f1", "38202e"), ("ffffff", "14181d")),  # purple
    (("b87800", "e6a52e"), ("fcf1d9", "352a10"), ("ffffff", "14181d")),  # orange
    (("2f93cf", "7cc4ef"), ("e5f4fc", "12303f"), ("ffffff", "14181d")),  # sky
)


def colour_of(owner: int) -> int:
    """Return the index of the owner's colour.

    Only the first owner has grey. The other owners share the remaining colours.
    """
    return 1 + (owner - 1) % (len(_OWNERS) - 1) if owner else 0


def _of_owner(index: int) -> dict[str, Style]:
    line, box, on_line = _OWNERS[index]
    return {
        f"box{index}": Style(fill=box, stroke=line, width=1.2),
        f"badge{index}": Style(fill=line),
        f"number{index}": Style(fill=on_line, size=10.0, bold=True),
        f"edge{index}": Style(stroke=line, width=1.4),
    }


#: Styles by name. A shape names one or two styles; the second overrides the first.
STYLES: dict[str, Style] = {
    "paper": Style(fill=PAPER),
    "group": Style(fill=("f7f8fa", "1b2027"), stroke=("c4cbd3", "434c57"), width=1.0),
    "root": Style(fill=PAPER, stroke=INK, width=1.4),
    "sample": Style(stroke=INK, width=1.4),
    "name": Style(fill=INK, size=12.0),
    "more": Style(fill=SOFT, size=10.0),
    "label": Style(fill=SOFT, size=10.5),
    "title": Style(fill=INK, size=16.0, bold=True),
    **{name: style for index in range(len(_OWNERS)) for name, style in _of_owner(index).items()},
    "static": Style(),
    "joint": Style(width=2.0, dash=(7.0, 3.0)),
    "dynamic": Style(width=2.2, dash=(2.2, 2.8)),
    "alternative": Style(width=1.2, dash=(1.2, 3.6, 6.0, 3.6)),
}


#: Character widths of Helvetica from the space to the tilde, in thousandths of the font size
#: (Adobe's metrics). Arial, Liberation Sans and Nimbus Sans have the same widths.
_ASCII = (
    278,
    278,
    355,
    556,
    556,
    889,
    667,
    191,
    333,
    333,
    389,
    584,
    278,
    333,
    278,
    278,
    556,
    556,
    556,
    556,
    556,
    556,
    556,
    556,
    556,
    556,
    278,
    278,
    584,
    584,
    584,
    556,
    1015,
    667,
    667,
    722,
    722,
    667,
    611,
    778,
    722,
    278,
    500,
    667,
    556,
    833,
    722,
    778,
    667,
    778,
    722,
    667,
    611,
    722,
    667,
    944,
    667,
    667,
    611,
    278,
    278,
    278,
    469,
    556,
    333,
    556,
    556,
    500,
    556,
    556,
    278,
    556,
    556,
    222,
    222,
    500,
    222,
    833,
    556,
    556,
    556,
    556,
    333,
    500,
    278,
    556,
    500,
    722,
    500,
    500,
    500,
    334,
    260,
    334,
    584,
)
_WIDTHS = {chr(32 + index): width for index, width in enumerate(_ASCII)} | {"·": 278, "°": 400}
_OTHER_WIDTH = 1000
_BOLD = 1.08

_MAX_CHARACTERS = 72


@lru_cache(maxsize=1 << 14)
def width_of(text: str, size: float, *, bold: bool = False) -> float:
    """Return the width of the text in the unit of ``size``, rounded to a tenth.

    A character beyond ASCII counts as wide as ``size``.
    """
    thousandths = sum([_WIDTHS.get(character, _OTHER_WIDTH) for character in text])
    return math.ceil(thousandths * size * (_BOLD if bold else 1.0) / 100) / 10


def shorten_label(text: str) -> str:
    """Return the text as drawn.

    Invisible characters become escapes. A long text keeps its beginning and end.
    """
    text = visible(text)
    if len(text) <= _MAX_CHARACTERS:
        return text
    half = _MAX_CHARACTERS // 2
    return f"{text[: half - 1]}…{text[-half:]}"
