"""A file's data with the span of every key and value, and the comments for tfcompose.

A comment is ``# tfcompose: allow TF401 because …``, or ``<!-- tfcompose: allow … -->`` in XML. It
applies to its own line. A comment alone on a line applies to the next line. In XML, a comment
applies to the complete tag that begins or ends on its line. Alone on a line, it applies to the
next opening tag.
"""

from __future__ import annotations

import posixpath
import re
from bisect import bisect_right
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from tfcompose.foundation.findings import Allow, Finding, RejectedError, Span, finding
from tfcompose.spec.load.nodes import MOST_VALUES, DocumentReader, Location, Path
from tfcompose.spec.load.syntax import no_yaml

if TYPE_CHECKING:
    __all__ = ["MOST_VALUES", "Path", "Source", "Spans", "find_path", "load", "refuse_unreadable"]

MOST_CHARACTERS = 4_000_000


@dataclass(frozen=True, slots=True)
class Spans:
    """Spans of a file's keys and values, and the findings so far.

    Spans are ignored in comparisons.
    """

    file: str = field(compare=False)
    places: Location = field(compare=False)
    findings: tuple[Finding, ...] = field(default=(), compare=False, kw_only=True)
    allows: tuple[Allow, ...] = field(default=(), compare=False, kw_only=True)
    #: Spans of replaced values by path, the last replaced value first.
    replaced: dict[Path, tuple[Span, ...]] = field(
        default_factory=dict, compare=False, kw_only=True
    )
    #: Whether profiles or overlays are merged over the file.
    is_variant: bool = field(default=False, compare=False, kw_only=True)
    #: Names of the merged profiles, in order.
    profiles: tuple[str, ...] = field(default=(), compare=False, kw_only=True)
    #: Files of the merged overlays, and settings as ``--set PATH=VALUE``, in order.
    overlays: tuple[str, ...] = field(default=(), compare=False, kw_only=True)

    def span_of(self, path: Path) -> Span:
        """Return the span of the value at a path, or of the nearest enclosing mapping or list."""
        return self.places.nearest(path).span

    def key_span(self, path: Path) -> Span:
        """Return the span of the key at a path, or of the nearest enclosing key."""
        key = self.places.nearest_key(path)
        return key.span if key else Span(self.file)

    def exact_span(self, path: Path) -> Span | None:
        """Return the span of the value at a path, None without a value."""
        location = self.places.get(path)
        return location.span if location else None

    def has_key(self, path: Path) -> bool:
        """Return whether the last step of the path is a key in the file."""
        around = self.places.get(path[:-1])
        return bool(path) and around is not None and path[-1] in around.keys

    def has(self, path: Path) -> bool:
        """Return whether a value exists at the path."""
        return self.places.get(path) is not None


@dataclass(frozen=True, slots=True)
class Source(Spans):
    """A file's plain data with spans: the input of validation."""

    #: The data. Aliases of an anchor are the same object. The data are never modified.
    data: dict[str, Any]
    #: Whether values may be null.
    has_nulls: bool = field(default=True, compare=False, kw_only=True)

    def mapping(self, *path: str | int) -> dict[str, Any]:
        """Return the mapping at a path, empty without one."""
        data: Any = self.data
        for step in path:
            data = data.get(step) if isinstance(data, dict) else None
        return data if isinstance(data, dict) else {}

    def part(self, path: Path) -> Source:
        """Return the mapping at ``path`` as a separate source without findings."""
        return Source(self.file, self.places.nearest(path), self.mapping(*path))


def load(text: str, file: str, expected: str = "a robot begins with: tfcompose: 1") -> Source:
    """Return the mapping in the YAML text.

    ``expected`` is the help for a text that holds none.

    Raises:
        RejectedError: if the text is not YAML, not a single document, not a mapping, or too
            large for a robot.
    """
    refuse_unreadable(text, file)
    if (begin := text.lstrip("\ufeff \t\r\n")).startswith("<") and not begin.startswith("<<"):
        raise RejectedError([no_yaml(text, file)])
    reader = DocumentReader(file)
    reader.read(text)
    data, location = reader.documents[0] if reader.documents else (None, Location(Span(file)))
    if not isinstance(data, dict):
        what = (
            "a list"
            if isinstance(data, list)
            else "a single value"
            if reader.documents
            else "empty"
        )
        message = f"the file is {what}, not a mapping of keys and values"
        raise RejectedError([finding("TF002", message, location.span, help=expected)])
    if "spec_digest" in data and "tfcompose" not in data:
        advice = (
            "name the robot file that it was built from; up, verify, doctor and export take a"
            " plan too"
        )
        raise RejectedError(
            [finding("TF002", "this is a built plan, and no robot file", Span(file), help=advice)]
        )
    return Source(
        file,
        location,
        data,
        findings=tuple(reader.findings),
        allows=allows_in(text, file),
        has_nulls=reader.has_nulls,
    )


def refuse_unreadable(text: str, file: str, most_characters: int = MOST_CHARACTERS) -> None:
    """Reject a file that is too large or is not text.

    Raises:
        RejectedError: if it is too large or is not text.
    """
    if len(text) > most_characters:
        message = f"the file has {len(text):,} characters; a robot has at most {most_characters:,}"
        raise RejectedError([finding("TF008", message, Span(file))])
    if "\0" in text:
        line = text.count("\n", 0, text.index("\0")) + 1
        raise RejectedError(
            [
                finding(
                    "TF001",
                    "not a text file: it holds a NUL byte",
                    Span(file, line),
                    help="remove it",
                )
            ]
        )


def find_path(named: str, span: Span) -> str:
    """Return the path of a file that is named at a span.

    A relative path starts at the folder of the span's file, or at the working directory.
    """
    folder = (
        "" if span.file.startswith("--") else posixpath.dirname(span.file)
    )  # --set and similar
    return posixpath.normpath(posixpath.join(folder, named))


_COMMENT = re.compile(
    r"#\s*tfcompose:\s*allow\b(?P<codes>[\sA-Z0-9,]*?)(?:\bbecause\b(?P<reason>[^#]*))?(?:#.*)?$"
)
_XML = re.compile(
    r"\s*tfcompose:\s*allow\b(?P<codes>[\sA-Z0-9,]*?)(?:\bbecause\b(?P<reason>.*))?\s*", re.DOTALL
)
#: Markup that begins with ``<``; opening tags and comments are distinguished.
_MARKUP = re.compile(
    r"<!--(?P<comment>.*?)-->|<!\[CDATA\[.*?\]\]>|<\?.*?\?>"
    r"|(?P<tag><[^\s<>\"'/!?](?:[^<>\"']|\"[^\"]*\"|'[^']*')*>)|<",
    re.DOTALL,
)
_CODE = re.compile(r"[A-Z]+[0-9]+")


def allows_in(text: str, file: str) -> tuple[Allow, ...]:
    """Return the comments for tfcompose in a file's text."""
    allows = []
    for number, line in enumerate(text.splitlines(), 1):
        match = _COMMENT.search(line) if "tfcompose:" in line else None
        if match:
            alone = not line[: match.start()].strip()
            span = Span(file, number, match.start() + 1, number, len(line) + 1)
            codes = tuple(_CODE.findall(match["codes"]))
            allows.append(Allow(codes, number + alone, (match["reason"] or "").strip(), span))
    return tuple(allows)


def allows_in_xml(text: str, file: str) -> tuple[Allow, ...]:
    """Return the comments for tfcompose in an XML file's text."""
    if "tfcompose:" not in text:
        return ()
    starts = [0, *(match.end() for match in re.finditer("\r\n|\r|\n", text))]
    allows: list[Allow] = []
    waiting: list[int] = []  # comments alone on a line, which apply to the next tag
    tag = (0, 0)  # first and last line of the last opening tag
    for markup in _MARKUP.finditer(text):
        if markup["comment"] is None:
            if markup["tag"]:
                tag = (
                    bisect_right(starts, markup.start()),
                    bisect_right(starts, markup.end() - 1),
                )
                for index in waiting:
                    allows[index] = replace(allows[index], line=tag[0], last=tag[1])
            waiting.clear()
            continue
        match = _XML.fullmatch(markup["comment"])
        if match is None:
            continue
        span = _span(file, starts, markup.start(), markup.end())
        alone = not text[starts[span.line - 1] : markup.start()].strip()
        if alone:
            waiting.append(len(allows))
        first, last = (
            (span.end_line + 1, 0) if alone else tag if tag[1] == span.line else (span.line, 0)
        )
        reason = " ".join((match["reason"] or "").split())
        allows.append(Allow(tuple(_CODE.findall(match["codes"])), first, reason, span, last))
    return tuple(allows)


def _span(file: str, starts: list[int], begin: int, end: int) -> Span:
    line, end_line = bisect_right(starts, begin), bisect_right(starts, end)
    return Span(file, line, begin - starts[line - 1] + 1, end_line, end - starts[end_line - 1] + 1)
