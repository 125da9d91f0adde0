"""How wide text is: in Helvetica, whose widths Arial, Liberation Sans and Nimbus Sans share."""

from __future__ import annotations

import math
from functools import lru_cache

#: Thousandths of the font's size, from the space to the tilde (Adobe's metrics of Helvetica).
_ASCII = (
    278, 278, 355, 556, 556, 889, 667, 191, 333, 333, 389, 584, 278, 333, 278, 278,
    556, 556, 556, 556, 556, 556, 556, 556, 556, 556, 278, 278, 584, 584, 584, 556,
    1015, 667, 667, 722, 722, 667, 611, 778, 722, 278, 500, 667, 556, 833, 722, 778,
    667, 778, 722, 667, 611, 722, 667, 944, 667, 667, 611, 278, 278, 278, 469, 556,
    333, 556, 556, 500, 556, 556, 278, 556, 556, 222, 222, 500, 222, 833, 556, 556,
    556, 556, 333, 500, 278, 556, 500, 722, 500, 500, 500, 334, 260, 334, 584,
)  # fmt: skip
_WIDTHS = {chr(32 + index): width for index, width in enumerate(_ASCII)} | {"·": 278, "°": 400}
_OTHER = 1000
_BOLD = 1.08

MOST_LETTERS = 72


@lru_cache(maxsize=1 << 14)
def width_of(text: str, size: float, *, bold: bool = False) -> float:
    """Return how wide the text is, in the unit of ``size``, to a tenth.

    Other letters than ASCII count as wide as they are high.
    """
    thousandths = sum([_WIDTHS.get(letter, _OTHER) for letter in text])
    return math.ceil(thousandths * size * (_BOLD if bold else 1.0) / 100) / 10


def visible(text: str) -> str:
    """Return the text with what cannot be seen, such as control characters, as escapes."""
    return text if text.isprintable() else "".join(one if one.isprintable() else ascii(one)[1:-1] for one in text)


def shown(text: str) -> str:
    """Return the text as it is drawn: what cannot be seen as escapes, and of a long one its beginning and end."""
    text = visible(text)
    if len(text) <= MOST_LETTERS:
        return text
    half = MOST_LETTERS // 2
    return f"{text[: half - 1]}…{text[-half:]}"
