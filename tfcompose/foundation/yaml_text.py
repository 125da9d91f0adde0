"""YAML text as people write robot files.

An entry is on a single line if it fits. Numbers, names and words are bare, and all other text is
in quotes.
"""

from __future__ import annotations

import math
import re
from textwrap import dedent, indent
from typing import TYPE_CHECKING, Any

from tfcompose.foundation.numbers import number
from tfcompose.foundation.text import mask_invisible

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

WIDTH = 120

#: Maximum number of digits that people write, and the relative size of rounding noise.
_DIGITS, _LEFT_BEHIND = 12, 4e-16

#: Text that needs no quotes: a path, an address, words, a quantity with its unit.
_PLAIN = re.compile(
    r"(?:[a-z]+://|\.{0,2}/)?[A-Za-z_][A-Za-z0-9_./+-]*(?: [A-Za-z0-9_./+-]+)*"
    r"|-?[0-9]+(?:\.[0-9]+)? [A-Za-z%][A-Za-z/]*"
)
#: Words that readers of other versions of YAML do not read as strings.
_RESERVED = frozenset({"true", "false", "null", "yes", "no", "on", "off", "y", "n", "nan", "inf"})
_ESCAPES = {'"': '\\"', "\\": "\\\\", "\n": "\\n", "\t": "\\t", "\r": "\\r"}


class Bare(str):
    """A text to write without quotes although its characters need them, such as a typed number."""

    __slots__ = ()


class Literal(str):
    """A text of several lines, written as a literal block."""

    __slots__ = ()


def entry(key: str, value: Any, depth: int = 0) -> list[str]:
    """Return the lines of a key and its value: one line if it fits, otherwise a block."""
    before = "  " * depth
    head = f"{before}{text(key)}:"
    if isinstance(value, Literal):
        lines = _literal(value)
        return (
            [f"{head} {text(value)}"]
            if lines is None
            else [f"{head} |", *(indent(line, before + "  ") for line in lines)]
        )
    line = f"{head} {flow(value)}"
    if len(line) <= WIDTH or not isinstance(value, (dict, list)) or not _splits(value):
        return [line]
    if isinstance(value, list):
        return [head, *(line for item in value for line in _item(item, depth + 1))]
    return [
        head,
        *(line for inner, item in value.items() for line in entry(inner, item, depth + 1)),
    ]


def _splits(value: Any) -> bool:
    """Return whether the value can be split into lines. Lists of numbers and ``{}`` cannot."""
    return (
        bool(value)
        if isinstance(value, dict)
        else any(isinstance(item, (dict, str)) for item in value)
    )


def _item(value: Any, depth: int) -> list[str]:
    before = "  " * depth
    line = f"{before}- {flow(value)}"
    if len(line) <= WIDTH or not isinstance(value, dict):
        return [line]
    lines = [line for key, item in value.items() for line in entry(key, item, depth + 1)]
    return [f"{before}- {lines[0].lstrip()}", *lines[1:]]


def flow(value: Any) -> str:
    """Return the value on a single line."""
    if isinstance(value, dict):
        return f"{{{', '.join(f'{text(key)}: {flow(item)}' for key, item in value.items())}}}"
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(map(flow, value))}]"
    if value is None:
        return "null"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, (int, float)):
        return number(_as_people_write(float(value)))
    return text(value)


def parameter(value: Any) -> Any:
    """Return a node's parameter so that it is written with its type.

    For example, 20.0 is a double, and 20 is an integer.
    """
    if isinstance(value, list):
        return [parameter(item) for item in value]
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return value
    if isinstance(value, int):
        return Bare(value)
    if not math.isfinite(value):
        return Bare(f"{'-' * (value < 0)}.{'nan' if math.isnan(value) else 'inf'}")
    mantissa, exponent, power = repr(value).partition("e")
    return Bare(f"{mantissa}{'' if '.' in mantissa else '.0'}{exponent}{power}")


def _as_people_write(value: float) -> float:
    """Return the number without rounding noise in its last digits.

    For example, 0.010267499999999999 becomes 0.0102675.
    """
    near = float(f"{value:.{_DIGITS}g}")
    return near if abs(near - value) <= _LEFT_BEHIND * abs(value) else value


def text(value: str) -> str:
    """Return a text, in quotes if YAML would otherwise not read it as a string."""
    if isinstance(value, Bare):
        return str(value)
    if _PLAIN.fullmatch(value) and value.lower() not in _RESERVED:
        return value
    return '"' + "".join(_ESCAPES.get(char) or _print_char(char) for char in value) + '"'


def _print_char(char: str) -> str:
    return char if char.isprintable() else f"\\U{ord(char):08x}"


def _literal(value: str) -> list[str] | None:
    """Return the lines of a literal block, None if the text cannot be written as one."""
    lines = value.splitlines()
    ends = any(line != line.rstrip() for line in lines)
    if (
        not lines
        or ends
        or lines[0][:1].isspace()
        or not all(line.replace("\t", " ").isprintable() for line in lines)
    ):
        return None
    return lines


def dedent_block(block: str) -> Literal:
    """Return the source text of an element without its indentation."""
    first, _, rest = block.strip().partition("\n")
    below = dedent(rest.expandtabs(2)) if rest else ""
    return Literal("\n".join(line.rstrip() for line in [first, *below.splitlines()]))


def comment(texts: Iterable[str], depth: int = 0) -> list[str]:
    """Return texts as comment lines, with long lines folded."""
    before = "  " * depth + "# "
    lines = []
    for text in texts:
        printed = mask_invisible(" ".join(text.split()), "?")
        lines += [before + line for line in _fold(printed, WIDTH - len(before))]
    return lines


def _fold(line: str, width: int) -> list[str]:
    lines = [""]
    for token in line.split(" "):
        if lines[-1] and len(lines[-1]) + 1 + len(token) > width:
            lines.append("  " + token)
        else:
            lines[-1] = (
                f"{lines[-1]} {token}".strip() if len(lines) == 1 else f"{lines[-1]} {token}"
            )
    return lines


def section(
    name: str, entries: Mapping[str, Any], notes: Mapping[str, Iterable[str]]
) -> list[str]:
    """Return a section with its entries and the comments above them.

    Empty for an empty section.
    """
    if not entries:
        return []
    lines = ["", f"{name}:"]
    for key, value in entries.items():
        lines += [*comment(notes.get(key, ()), 1), *entry(key, value, 1)]
    return lines
