"""How things look: one table, from which SVG takes its style sheet and PDF its operators.

The colours of owners are those of Okabe and Ito, which people with any kind of colour blindness tell apart; each owner
has a number as well, for print without colour and for robots with more owners than colours.
"""

from __future__ import annotations

from dataclasses import dataclass

SANS = "Arial, Helvetica, 'Liberation Sans', sans-serif"


@dataclass(frozen=True, slots=True)
class Style:
    """Colours as six hexadecimal digits, by day and by night; empty: none. Lengths in px."""

    fill: tuple[str, str] = ("", "")
    stroke: tuple[str, str] = ("", "")
    width: float = 0.0
    dash: tuple[float, ...] = ()
    size: float = 0.0
    bold: bool = False


PAPER = ("ffffff", "14181d")
INK = ("1b1f24", "e8ebee")
SOFT = ("57606a", "a3adb8")

#: Of each colour by day and by night: the line, the box, and what is written on the line's colour.
_OWNERS = (
    (("66707c", "8d98a5"), ("f1f3f5", "242a31"), ("ffffff", "14181d")),  # grey: static, as most edges are
    (("0072b2", "4ba3da"), ("e3f0f8", "152a3a"), ("ffffff", "14181d")),  # blue
    (("d55e00", "ef8235"), ("fbeadd", "38220f"), ("ffffff", "14181d")),  # vermilion
    (("008a64", "2bb58c"), ("e0f3ed", "10302a"), ("ffffff", "14181d")),  # green
    (("b8578c", "d98bb5"), ("f8e8f1", "38202e"), ("ffffff", "14181d")),  # purple
    (("b87800", "e6a52e"), ("fcf1d9", "352a10"), ("ffffff", "14181d")),  # orange
    (("2f93cf", "7cc4ef"), ("e5f4fc", "12303f"), ("ffffff", "14181d")),  # sky
)


def colour_of(owner: int) -> int:
    """Return the number of the owner's colour, from 0: the first has grey to itself, the others share the rest."""
    return 1 + (owner - 1) % (len(_OWNERS) - 1) if owner else 0


def _of_owner(index: int) -> dict[str, Style]:
    line, box, on_line = _OWNERS[index]
    return {
        f"box{index}": Style(fill=box, stroke=line, width=1.2),
        f"badge{index}": Style(fill=line),
        f"number{index}": Style(fill=on_line, size=10.0, bold=True),
        f"edge{index}": Style(stroke=line, width=1.4),
    }


#: By name; what is drawn names one or two, of which the second says what is different.
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


def style_of(look: str) -> Style:
    """Return the style of one or two names: width and dash of the second count, where it has them."""
    first, _, second = look.partition(" ")
    style = STYLES[first]
    if not second:
        return style
    over = STYLES[second]
    return Style(style.fill, style.stroke, over.width or style.width, over.dash, style.size, style.bold)
