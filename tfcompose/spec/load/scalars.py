"""Scalars by YAML 1.2's core schema: ``1e-3`` is a number, ``on`` is text, ``1:30`` is not 90.

PyYAML implements YAML 1.1. Only its parser is used here, with the patterns of the YAML 1.2.2
specification, section 10.3.2.
"""

from __future__ import annotations

import math
import re
from functools import lru_cache

TAG = "tag:yaml.org,2002:"
NULL, BOOL, INT, FLOAT, STR, MAP, SEQ = (
    TAG + kind for kind in ("null", "bool", "int", "float", "str", "map", "seq")
)

#: Tag, pattern and possible first characters, in the order in which to try them.
IMPLICIT = (
    (NULL, re.compile(r"(?:null|Null|NULL|~|)\Z"), "nN~"),
    (BOOL, re.compile(r"(?:true|True|TRUE|false|False|FALSE)\Z"), "tTfF"),
    (INT, re.compile(r"(?:[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+)\Z"), "-+0123456789"),
    (
        FLOAT,
        re.compile(
            r"(?:[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?"
            r"|[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN))\Z"
        ),
        "-+.0123456789",
    ),
)

#: Numbers that are not finite, by their notation in YAML in lower case.
NOT_FINITE = {text: float(text.replace(".", "")) for text in (".inf", "+.inf", "-.inf", ".nan")}
_PATTERNS = {tag: pattern for tag, pattern, _ in IMPLICIT}
_FIRST = "nN~tTfF-+.0123456789"

SCALAR_TAGS = frozenset((STR, *(tag for tag, _, _ in IMPLICIT)))

_MOST_DIGITS = 300
#: Maximum number of characters of a rejected number in a finding.
_MOST_SHOWN = 40


def implicit_tag(text: str) -> str:
    """Return the tag of a plain scalar."""
    if text[:1] not in _FIRST:
        return STR
    for tag, pattern, first in IMPLICIT:
        if text[:1] in first and pattern.match(text):
            return tag
    return STR


@lru_cache(maxsize=4096)
def plain(text: str) -> str | bool | int | float | None:
    """Return the value of a plain scalar.

    Raises:
        OverflowError: if it is not a finite number.
    """
    return scalar(implicit_tag(text), text) if text[:1] in _FIRST else text


def scalar(tag: str, text: str) -> str | bool | int | float | None:
    """Return the value of a scalar with one of the core tags.

    Raises:
        ValueError: if the text does not match its explicit tag, or is not a finite number.
    """
    if tag == STR:
        return text
    if not _PATTERNS[tag].match(text):
        raise ValueError(f"{text!r} is not of type {tag.removeprefix(TAG)}")
    if tag == NULL:
        return None
    if tag == BOOL:
        return text.lower() == "true"
    return _number(tag, text)


def _number(tag: str, text: str) -> int | float:
    if tag == INT and text[:2] in {"0o", "0x"}:
        number = int(text, 0)  # Python limits only the digits of decimal numbers
        return number if len(text) < _MOST_DIGITS else _finite(_to_float(number), text)
    if tag == INT and len(text) < _MOST_DIGITS:
        return int(text)
    value = NOT_FINITE.get(text.lower())
    return _finite(float(text) if value is None else value, text)


def _to_float(number: int) -> float:
    """Return the number as a float, infinity if it is too large."""
    try:
        return float(number)
    except OverflowError:
        return math.inf


def _finite(value: float, text: str) -> float:
    if not math.isfinite(value):
        quoted = (
            text if len(text) <= _MOST_SHOWN else f"{text[:_MOST_SHOWN]}… ({len(text)} characters)"
        )
        raise OverflowError(f"{quoted} is not a finite number")
    return value
