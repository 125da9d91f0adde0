"""Where in its files an error of xacro's is: xacro names the expression and the macros, and neither line nor column."""

from __future__ import annotations

import os
import re
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tfcompose.findings import Finding, Note, Span

if TYPE_CHECKING:
    from collections.abc import Iterator

#: What xacro says, and how that begins where it stands.
_SAID = (
    (re.compile(r"when evaluating expression '(.+)'"), r"\$\{{\s*{}\s*\}}"),
    (re.compile(r"unknown macro name: (xacro:\S+)"), r"<{}(?=[\s/>])"),
)
_MACRO = r"""<xacro:macro\s[^>]*?\bname\s*=\s*["'](?:xacro:)?{}["']"""
#: How many macros are named, those around them counted.
_MOST = 5


def placed(found: Finding, error: Any, files: list[str], macros: list[Any]) -> Finding:
    """Return the finding at the words that it is about, with notes about the macros that were expanded then.

    ``files`` are those that were being read, the innermost last, and so are ``macros``. The finding stays where it is
    if the words are not to be found. Places are in the files as xacro names them.
    """
    files = [file for file in files if file]
    around = dict.fromkeys((macro.body.getAttribute("name"), macro.history[-1][-1]) for macro in reversed(macros))
    inner = [(name, at) for name, file in around if (at := _first(file, _MACRO.format(re.escape(name)), 0))]
    notes = [Note(f"in the macro {name}", at) for name, at in inner[:_MOST]]
    if getattr(error, "lineno", None) is not None and files:  # an ExpatError; its columns count from 0
        line, column = error.lineno, error.offset + 1
        place: Span | None = Span(files[-1], line, column, line, column + 1)
    else:
        begins = [(at.file, at.line) for _, at in inner] + [(file, 0) for file in reversed(files)]
        place = next((at for file, line in begins for at in _said_at(found.message, file, line)), found.span)
    return replace(found, span=place, notes=(*found.notes, *notes))


def _said_at(message: str, file: str, line: int) -> Iterator[Span]:
    """Yield where the file has what the message names, from a line on."""
    for said, written in _SAID:
        for found in said.finditer(message):
            words = r"\s+".join(re.escape(word) for word in found[1].split())
            at = _first(file, written.format(words), line)
            if at:
                yield at


def _first(file: str | None, pattern: str, line: int) -> Span | None:
    """Return the first place of the pattern in the file from a line on, or None."""
    if not file:
        return None
    text = Path(file).read_text("utf-8", "replace")
    start = sum(map(len, text.splitlines(keepends=True)[: max(line - 1, 0)]))
    found = re.compile(pattern).search(text, start)
    if found is None:
        return None
    return Span(file, *_position(text, found.start()), *_position(text, found.end()))


def _position(text: str, index: int) -> tuple[int, int]:
    return text.count("\n", 0, index) + 1, index - text.rfind("\n", 0, index)


def seen_from(file: str, found: Finding) -> Finding:
    """Return the finding with its places in files as seen from the working folder, and ``file`` as it is named."""

    def shown(span: Span | None) -> Span | None:
        if span is None or span.file == file:
            return span
        same = Path(span.file).absolute() == Path(file).absolute()
        return span._replace(file=file if same else os.path.relpath(span.file))

    notes = tuple(replace(note, span=shown(note.span)) for note in found.notes)
    return replace(found, span=shown(found.span), notes=notes)
