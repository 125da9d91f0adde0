"""Calibration files as plain data with spans.

A file is YAML of one or several documents, rows of numbers, or a launch file. The size limits are
those of robot files. xacro's tags ``!degrees`` and ``!radians`` are applied to plain numbers.
"""

from __future__ import annotations

import math
import re
from bisect import bisect_right
from itertools import accumulate
from typing import TYPE_CHECKING, Any, Literal

from tfcompose.foundation.findings import Span, finding
from tfcompose.spec.load.nodes import DocumentReader, Location
from tfcompose.spec.load.scalars import FLOAT, INT, implicit_tag, scalar
from tfcompose.spec.load.source import Source, refuse_unreadable

if TYPE_CHECKING:
    from collections.abc import Iterator

Form = Literal["yaml", "rows", "launch"]

#: The unit of each tag, in radians.
ANGLE_TAGS = {"!degrees": math.pi / 180, "!radians": 1.0}

PUBLISHER = "static_transform_publisher"

#: Limits for rows of numbers. A matrix has four rows. Larger texts are not read as a matrix.
MOST_ROWS, LONGEST_ROW = 64, 1000

_NUMBER = re.compile(r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?")
_WORD = re.compile(r"[^\s,]+")
_XML = re.compile(r"<!--(?:.*?-->|.*)|<node\b[^<>]*>", re.DOTALL)
_ARGS = re.compile(r"\bargs\s*=\s*(?:\"([^\"]*)\"|'([^']*)')")
_PYTHON = re.compile(r"#[^\n]*|\"([^\"\n]*)\"|'([^'\n]*)'|[\[\]]")


def load_calibration(text: str, file: str) -> tuple[Form, tuple[Source, ...]]:
    """Return the form of the file, and its documents.

    Rows of numbers are a single document, a list of lists. A launch file is a single document: a
    list with the command line of each of its ``static_transform_publisher`` nodes.

    Raises:
        RejectedError: if the text has none of these forms or is too large.
    """
    refuse_unreadable(text, file)
    lines = text.splitlines()
    filled = [line for line in lines if line.strip() and not line.lstrip().startswith("#")]
    if 0 < len(filled) <= MOST_ROWS and all(map(_is_row, filled)):
        return "rows", (_rows(lines, file),)
    if PUBLISHER in text and (text.lstrip().startswith("<") or "LaunchDescription" in text):
        return "launch", (_launch(text, file),)
    return "yaml", tuple(_documents(text, file))


def _is_row(line: str) -> bool:
    tokens = _WORD.findall(line) if len(line) < LONGEST_ROW else []
    return len(tokens) > 1 and all(map(_NUMBER.fullmatch, tokens))


def _documents(text: str, file: str) -> Iterator[Source]:
    reader = _CalibrationReader(file)
    reader.read(text, single=False)
    findings = tuple(reader.findings)
    for data, location in reader.documents:
        if data is not None and (
            not isinstance(data, str) or data.strip()
        ):  # output of ros2 topic echo ends with ---
            yield Source(file, location, data, findings=findings)
            findings = ()


class _CalibrationReader(DocumentReader):
    """Also reads numbers with xacro's tags for angles, in radians."""

    def read_tagged(self, tag: str, text: str, location: Location) -> Any:
        """Return the value of a scalar with a tag."""
        if tag not in ANGLE_TAGS:
            return super().read_tagged(tag, text, location)
        kind = implicit_tag(text.strip())
        if kind not in {INT, FLOAT}:
            message, advice = f"{tag} takes a number, not {text[:40]!r}", "write the number"
            self.findings.append(finding("TF005", message, location.span, help=advice))
            return 0.0
        return float(scalar(kind, text.strip()) or 0) * ANGLE_TAGS[tag]


class _LineOffsets:
    """Converts offsets in the text to lines and columns."""

    def __init__(self, text: str, file: str) -> None:
        self.file = file
        self.starts = [0, *accumulate(len(line) for line in text.splitlines(keepends=True))]

    def span(self, start: int, end: int) -> Span:
        first, last = bisect_right(self.starts, start) - 1, bisect_right(self.starts, end) - 1
        begin, stop = start - self.starts[first] + 1, end - self.starts[last] + 1
        return Span(self.file, first + 1, begin, last + 1, stop)


def _rows(lines: list[str], file: str) -> Source:
    places: dict[str | int, Location] = {}
    data: Any = []
    for number, line in enumerate(lines, 1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        row = [(m.group(), m.start() + 1, m.end() + 1) for m in _WORD.finditer(line)]
        line_span = Span(file, number, row[0][1], number, row[-1][2])
        tokens = {i: Location(Span(file, number, a, number, b)) for i, (_, a, b) in enumerate(row)}
        places[len(data)] = Location(line_span, tokens)
        data.append([token for token, _, _ in row])
    first = places[0].span
    return Source(
        file, Location(Span(file, first.line, first.column, len(lines) + 1, 1), places), data
    )


def _launch(text: str, file: str) -> Source:
    """Return the command line of each static_transform_publisher.

    Comments are ignored, and no code is run.
    """
    lines = _LineOffsets(text, file)
    places: dict[str | int, Location] = {}
    data: Any = []
    calls = _in_xml(text) if text.lstrip().startswith("<") else _in_python(text)
    for tokens in calls:
        if not tokens:
            continue
        inside = {
            index: Location(lines.span(start, end)) for index, (_, start, end) in enumerate(tokens)
        }
        places[len(data)] = Location(lines.span(tokens[0][1], tokens[-1][2]), inside)
        data.append([token for token, _, _ in tokens])
    return Source(file, Location(Span(file), places), data)


def _in_xml(text: str) -> Iterator[list[tuple[str, int, int]]]:
    for tag in _XML.finditer(text):
        arguments = (
            _ARGS.search(tag.group())
            if PUBLISHER in tag.group() and tag.group()[1] != "!"
            else None
        )
        if arguments:
            which = 1 if arguments[1] is not None else 2
            begin = tag.start() + arguments.start(which)
            yield [
                (m.group(), begin + m.start(), begin + m.end())
                for m in re.finditer(r"\S+", arguments[which])
            ]


def _in_python(text: str) -> Iterator[list[tuple[str, int, int]]]:
    """Yield the strings of the list that follows each mention of the publisher."""
    tokens: list[tuple[str, int, int]] = []
    named = inside = False
    for token in _PYTHON.finditer(text):
        literal = token[1] if token[1] is not None else token[2]
        if token.group() == "[":
            inside = named
        elif token.group() == "]" and inside:
            yield tokens
            tokens, named, inside = [], False, False
        elif literal is not None and inside:
            tokens.append((literal, token.start(), token.end()))
        elif literal == PUBLISHER:
            named = True
