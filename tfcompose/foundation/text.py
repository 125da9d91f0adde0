"""Numbers, lists and durations as text for people."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable

#: Maximum number of names to print from a list.
LISTED = 6


def plural(number: int, noun: str) -> str:
    """Return the number with the noun in singular or plural: "1 edge", "2 edges"."""
    return f"{number} {noun}{'' if number == 1 else 's'}"


def with_more(first: str, more: int, noun: str = "edge") -> str:
    """Return the first name and the number of further names: "a and 2 more edges"."""
    return f"{first} and {plural(more, f'more {noun}')}" if more else first


def list_names(names: Iterable[object], most: int = LISTED) -> str:
    """Return the first names separated by commas, and the number of further names.

    For example, "a, b and 3 more".
    """
    some = [str(name) for name in names]
    more = f" and {len(some) - most} more" if len(some) > most else ""
    return ", ".join(some[:most]) + more


def duration(seconds: float) -> str:
    """Return a duration without its sign as text: 120 ms, 3.2 s, 2.5 h, 12 days."""
    size = abs(seconds)
    if size < 1:
        return f"{size * 1000:.0f} ms"
    if size < 600:  # noqa: PLR2004 (ten minutes)
        return f"{size:.3g} s"
    return f"{size / 3600:.3g} h" if size < 48 * 3600 else f"{size / 86400:,.0f} days"


def visible(text: str) -> str:
    """Return the text with invisible characters, such as control characters, escaped."""
    return "".join(map(_visible_character, text))


def _visible_character(character: str) -> str:
    return character if character.isprintable() else ascii(character)[1:-1]


def mask_invisible(text: str, mark: str, kept: str = "") -> str:
    """Return the text with a mark for each invisible character, except characters in ``kept``."""
    if text.isprintable():
        return text
    hidden = {character for character in text if not character.isprintable()} - {*kept}
    return text.translate(dict.fromkeys(map(ord, hidden), mark))
