"""Macros of a xacro file: their parameters, calls of a macro, and the expansion.

``expand`` runs xacro. ``macro`` writes a macro.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tfcompose.foundation.findings import Span

NAMESPACE = 'xmlns:xacro="http://www.ros.org/wiki/xacro"'
#: The start tag of a macro's definition up to its name, and the parameters in that tag.
_MACRO = re.compile(r"""<xacro:macro\s[^>]{0,4000}?\bname\s*=\s*["'](?:xacro:)?([^"']+)""")
#: Maximum number of characters of a tag.
_LONGEST = 100_000
_PARAMS = re.compile(r"""\bparams\s*=\s*(?:"([^"]*)"|'([^']*)')""")


@dataclass(frozen=True, slots=True)
class Expansion:
    """The expanded text of a xacro file, and the places where its elements are written."""

    text: str
    #: Files; ``places`` and ``comments`` refer to them by index.
    files: tuple[str, ...]
    #: The place of each element in document order: file index, line, column from 0. None for an
    #: element that is in no file.
    places: tuple[tuple[int, int, int] | None, ...]
    #: The places of comments that allow findings, without comments that xacro left out.
    comments: tuple[tuple[int, int, int], ...] = ()


@dataclass(frozen=True, slots=True)
class Use:
    """A robot file's use of a xacro file, as a complete file or through one of its macros."""

    #: The span of the file's name, in the robot file or on the command line.
    span: Span
    #: The macro to call; empty for the complete file.
    macro: str = ""
    #: The macro's text parameters, by name.
    words: dict[str, str] = field(default_factory=dict)
    #: The macro's block parameters, as XML.
    blocks: tuple[str, ...] = ()
    #: Files that the macro needs included.
    files: tuple[str, ...] = ()
    #: The span in the robot file of each entry of ``words``, by name.
    places: dict[str, Span] = field(default_factory=dict)


def macros_in(text: str) -> dict[str, str]:
    """Return the parameters of each macro that a xacro file defines, by macro name."""
    macros = {}
    for match in _MACRO.finditer(text):
        end = text.find(">", match.end(), match.end() + _LONGEST)
        params = _PARAMS.search(text[match.start() : end]) if end >= 0 else None
        macros[match[1]] = " ".join((params[1] or params[2] or "").split()) if params else ""
    return macros
