"""Numbers, lists and durations as people read them."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable

#: How many names of a list are shown.
LISTED = 6


def plural(number: int, noun: str) -> str:
    """Return the number with the noun, pluralised if needed: "1 edge", "2 edges"."""
    return f"{number} {noun}{'' if number == 1 else 's'}"


def with_more(first: str, more: int, noun: str = "edge") -> str:
    """Return the first name, and how many there are besides: "a and 2 more edges"."""
    return f"{first} and {plural(more, f'more {noun}')}" if more else first


def list_names(names: Iterable[object], most: int = LISTED) -> str:
    """Return names with commas, and how many more there are than the first few.

    "a, b and 3 more".
    """
    some = [str(name) for name in names]
    more = f" and {len(some) - most} more" if len(some) > most else ""
    return ", ".join(some[:most]) + more


def duration(seconds: float) -> str:
    """Return how long a time is, without its sign: 120 ms, 3.2 s, 2.5 h, 12 days."""
    size = abs(seconds)
    if size < 1:
        return f"{size * 1000:.0f} ms"
    if size < 600:  # noqa: PLR2004 (ten minutes)
        return f"{size:.3g} s"
    return f"{size / 3600:.3g} h" if size < 48 * 3600 else f"{size / 86400:,.0f} days"


def visible(text: str) -> str:
    """Return the text with invisible characters, such as control characters, as Python escapes."""
    return "".join(map(_visible_character, text))


def _visible_character(character: str) -> str:
    return character if character.isprintable() else ascii(character)[1:-1]


def mask_invisible(text: str, mark: str, kept: str = "") -> str:
    """Return the text with a mark for each invisible character, except those of ``kept``."""
    if text.isprintable():
        return text
    hidden = {character for character in text if not character.isprintable()} - {*kept}
    return text.translate(dict.fromkeys(map(ord, hidden), mark))
