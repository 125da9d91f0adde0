"""Macros of a xacro file: what they define, how one is called, and the result.

``expand`` runs xacro, ``macro`` writes a macro.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tfcompose.foundation.findings import Span

NAMESPACE = 'xmlns:xacro="http://www.ros.org/wiki/xacro"'
#: How a file defines a macro, up to its name, and the macro's parameters in that tag.
_MACRO = re.compile(r"""<xacro:macro\s[^>]{0,4000}?\bname\s*=\s*["'](?:xacro:)?([^"']+)""")
#: Characters of a tag.
_LONGEST = 100_000
_PARAMS = re.compile(r"""\bparams\s*=\s*(?:"([^"]*)"|'([^']*)')""")


@dataclass(frozen=True, slots=True)
class Expansion:
    """What xacro makes of a file, with where that is written.

    ``places`` are those of the elements, in the order of the text: a file of ``files``, by its
    number, a line, and a column, which counts from 0; None for an element that is in no file.
    ``comments`` are those of comments that allow findings, and were kept.
    """

    text: str
    files: tuple[str, ...]
    places: tuple[tuple[int, int, int] | None, ...]
    comments: tuple[tuple[int, int, int], ...] = ()


@dataclass(frozen=True, slots=True)
class Use:
    """How a robot file uses a xacro file, ``span`` a place.

    As a whole, or a call of a ``macro`` that is defined there.

    The macro's parameters are words, of which ``places`` holds where they are given, and blocks of
    XML; ``files`` are what is included for it.
    """

    span: Span
    macro: str = ""
    words: dict[str, str] = field(default_factory=dict)
    blocks: tuple[str, ...] = ()
    files: tuple[str, ...] = ()
    places: dict[str, Span] = field(default_factory=dict)


def macros_in(text: str) -> dict[str, str]:
    """Return the parameters of each macro that a xacro file defines, by macro name."""
    macros = {}
    for match in _MACRO.finditer(text):
        end = text.find(">", match.end(), match.end() + _LONGEST)
        params = _PARAMS.search(text[match.start() : end]) if end >= 0 else None
        macros[match[1]] = " ".join((params[1] or params[2] or "").split()) if params else ""
    return macros
