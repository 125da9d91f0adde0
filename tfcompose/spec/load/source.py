"""A file's data with the place of every key and value, and tfcompose's comments.

Those are ``# tfcompose: allow TF401 because …``, in XML ``<!-- tfcompose: allow … -->``. A comment
counts for its own line, or, alone on a line, for the next one. In XML that is the whole tag that
begins or ends on the line, whatever the number of its lines, or, alone on a line, the next tag
that opens.
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
    """Spans of a file: where each key and value is, and the findings so far.

    Spans take no part in equality.
    """

    file: str = field(compare=False)
    places: Location = field(compare=False)
    findings: tuple[Finding, ...] = field(default=(), compare=False, kw_only=True)
    allows: tuple[Allow, ...] = field(default=(), compare=False, kw_only=True)
    #: Spans of values that were overwritten, by path, the last one first.
    replaced: dict[Path, tuple[Span, ...]] = field(
        default_factory=dict, compare=False, kw_only=True
    )
    #: Whether profiles or overlays are merged over the file.
    is_variant: bool = field(default=False, compare=False, kw_only=True)
    #: The names of the merged profiles, in order.
    profiles: tuple[str, ...] = field(default=(), compare=False, kw_only=True)

    def span_of(self, path: Path) -> Span:
        """Return the value's place, or that of the nearest mapping or list around it."""
        return self.places.nearest(path).span

    def key_span(self, path: Path) -> Span:
        """Return the place of the key, or of the nearest key around it."""
        key = self.places.nearest_key(path)
        return key.span if key else Span(self.file)

    def exact_span(self, path: Path) -> Span | None:
        """Return the place of the value, or None if there is none at the path."""
        location = self.places.get(path)
        return location.span if location else None

    def has_key(self, path: Path) -> bool:
        """Return whether the last step of the path is a key that stands somewhere."""
        around = self.places.get(path[:-1])
        return bool(path) and around is not None and path[-1] in around.keys

    def has(self, path: Path) -> bool:
        """Return whether there is a value at the path."""
        return self.places.get(path) is not None


@dataclass(frozen=True, slots=True)
class Source(Spans):
    """A file's plain data, with its spans: the input of validation."""

    #: Aliases of one anchor are one object, which nothing changes.
    data: dict[str, Any]
    #: Whether values may be null.
    has_nulls: bool = field(default=True, compare=False, kw_only=True)

    def mapping(self, *path: str | int) -> dict[str, Any]:
        """Return the mapping at a path as it is written, empty where there is none."""
        data: Any = self.data
        for step in path:
            data = data.get(step) if isinstance(data, dict) else None
        return data if isinstance(data, dict) else {}

    def part(self, path: Path) -> Source:
        """Return the mapping at ``path`` as a source of its own, without what was found."""
        return Source(self.file, self.places.nearest(path), self.mapping(*path))


def load(text: str, file: str) -> Source:
    """Return the mapping that the YAML text holds.

    Raises:
        RejectedError: if the text is not YAML, not one document, not a mapping, or too large to be
            a robot.
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
        raise RejectedError(
            [finding("TF002", message, location.span, help="a robot begins with: tfcompose: 1")]
        )
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
    """Do nothing for a text that can be a file of this language.

    Raises:
        RejectedError: if it is too large, or no text.
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
    """Return the path of a file that is named at a place.

    Relative to the file there, or to the working folder.
    """
    folder = (
        "" if span.file.startswith("--") else posixpath.dirname(span.file)
    )  # --set and its like
    return posixpath.normpath(posixpath.join(folder, named))


_COMMENT = re.compile(
    r"#\s*tfcompose:\s*allow\b(?P<codes>[\sA-Z0-9,]*?)(?:\bbecause\b(?P<reason>[^#]*))?(?:#.*)?$"
)
_XML = re.compile(
    r"\s*tfcompose:\s*allow\b(?P<codes>[\sA-Z0-9,]*?)(?:\bbecause\b(?P<reason>.*))?\s*", re.DOTALL
)
#: What begins with ``<``, as one piece; tags that open, and comments, are distinguished.
_MARKUP = re.compile(
    r"<!--(?P<comment>.*?)-->|<!\[CDATA\[.*?\]\]>|<\?.*?\?>"
    r"|(?P<tag><[^\s<>\"'/!?](?:[^<>\"']|\"[^\"]*\"|'[^']*')*>)|<",
    re.DOTALL,
)
_CODE = re.compile(r"[A-Z]+[0-9]+")


def allows_in(text: str, file: str) -> tuple[Allow, ...]:
    """Return the comments in a file's text."""
    found = []
    for number, line in enumerate(text.splitlines(), 1):
        match = _COMMENT.search(line) if "tfcompose:" in line else None
        if match:
            alone = not line[: match.start()].strip()
            span = Span(file, number, match.start() + 1, number, len(line) + 1)
            codes = tuple(_CODE.findall(match["codes"]))
            found.append(Allow(codes, number + alone, (match["reason"] or "").strip(), span))
    return tuple(found)


def allows_in_xml(text: str, file: str) -> tuple[Allow, ...]:
    """Return the comments in an XML file's text."""
    if "tfcompose:" not in text:
        return ()
    starts = [0, *(match.end() for match in re.finditer("\r\n|\r|\n", text))]
    found: list[Allow] = []
    waiting: list[int] = []  # comments that stand alone, and wait for the tag that they are about
    tag = (0, 0)  # the first and the last line of the last tag that opened
    for markup in _MARKUP.finditer(text):
        if markup["comment"] is None:
            if markup["tag"]:
                tag = (
                    bisect_right(starts, markup.start()),
                    bisect_right(starts, markup.end() - 1),
                )
                for index in waiting:
                    found[index] = replace(found[index], line=tag[0], last=tag[1])
            waiting.clear()
            continue
        match = _XML.fullmatch(markup["comment"])
        if match is None:
            continue
        span = _span(file, starts, markup.start(), markup.end())
        alone = not text[starts[span.line - 1] : markup.start()].strip()
        if alone:
            waiting.append(len(found))
        first, last = (
            (span.end_line + 1, 0) if alone else tag if tag[1] == span.line else (span.line, 0)
        )
        reason = " ".join((match["reason"] or "").split())
        found.append(Allow(tuple(_CODE.findall(match["codes"])), first, reason, span, last))
    return tuple(found)


def _span(file: str, starts: list[int], begin: int, end: int) -> Span:
    line, end_line = bisect_right(starts, begin), bisect_right(starts, end)
    return Span(file, line, begin - starts[line - 1] + 1, end_line, end - starts[end_line - 1] + 1)
