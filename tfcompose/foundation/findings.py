"""Findings about a robot: a code, a message, a place and advice.

``lint``, the guard and the live tools share the codes. So a predicted second publisher and an
observed one are reported in the same way. A code is never reused for another meaning.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

from tfcompose.foundation.catalogue import CATALOGUE, Severity

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence


class Span(NamedTuple):
    """A range in a file. Lines and columns count from 1; the end is exclusive."""

    file: str
    line: int = 1
    column: int = 1
    end_line: int = 1
    end_column: int = 1

    def __str__(self) -> str:
        return f"{self.file}:{self.line}:{self.column}"

    def holds(self, other: Span) -> bool:
        """Return whether another range begins inside this range."""
        begin, end = (self.line, self.column), (self.end_line, self.end_column)
        return self.file == other.file and begin <= (other.line, other.column) < end


@dataclass(frozen=True, slots=True)
class Note:
    """A further place or fact for a finding."""

    message: str
    span: Span | None = None


@dataclass(frozen=True, slots=True)
class Edit:
    """A range in a file and its replacement. An empty range means an insertion."""

    span: Span
    #: The value of a scalar, whose quotes are kept, or YAML to insert unchanged.
    text: str


@dataclass(frozen=True, slots=True)
class Finding:
    """A fault in a file or a running tree, complete when it is created."""

    code: str
    name: str
    severity: Severity
    #: A line with the names and values involved, without advice.
    message: str
    #: The place, None for an observation of a live tree.
    span: Span | None = None
    #: Other places of a conflict, and further facts.
    notes: tuple[Note, ...] = ()
    #: The advice.
    help: str = ""
    #: Edits that together are the only safe fix, if there is one.
    edits: tuple[Edit, ...] = ()

    @property
    def label(self) -> str:
        """Code and name, such as "TF808 process_failed"."""
        return f"{self.code} {self.name}"

    @property
    def sort_key(self) -> tuple[str, int, int, str, str]:
        """The key for the order of display: by place, then by code."""
        span = self.span or Span("")
        return (span.file, span.line, span.column, self.code, self.message)


@dataclass(frozen=True, slots=True)
class Allow:
    """A comment that allows findings with these codes, with a reason."""

    codes: tuple[str, ...]
    line: int
    reason: str
    span: Span
    #: The last line to which it applies; 0 for ``line`` only.
    last: int = 0


class RejectedError(Exception):
    """A stage cannot continue. The error holds all findings of the stage, in order."""

    def __init__(self, findings: Iterable[Finding]) -> None:
        self.findings = tuple(sorted(findings, key=lambda finding: finding.sort_key))
        super().__init__("; ".join(finding.message for finding in self.findings))


def finding(  # noqa: PLR0913 (a finding has that many parts; all but three are named)
    code: str,
    message: str,
    span: Span | None,
    *,
    help: str = "",  # noqa: A002 (the field's name)
    notes: Iterable[Note] = (),
    severity: Severity | None = None,
    edits: Iterable[Edit] = (),
) -> Finding:
    """Return a finding with the name of its code, and by default the code's severity."""
    entry = CATALOGUE[code]
    return Finding(
        code,
        entry.name,
        severity or entry.severity,
        message=message,
        span=span,
        notes=tuple(notes),
        help=help,
        edits=tuple(edits),
    )


def without_duplicates(findings: Iterable[Finding]) -> list[Finding]:
    """Return the findings without duplicates, in order.

    Findings that differ only in notes are merged, with the notes of all of them.
    """
    first: dict[Finding, Finding] = {}
    for finding in findings:
        alone = replace(finding, notes=()) if finding.notes else finding
        before = first.setdefault(alone, finding)
        notes = dict.fromkeys((*before.notes, *finding.notes))
        if len(notes) > len(before.notes):
            first[alone] = replace(before, notes=tuple(notes))
    return list(first.values())


_BREAK = re.compile("\r\n|[\r\n\x85\u2028\u2029]")  # line breaks of YAML


def line_starts(text: str) -> list[int]:
    """Return the index at which each line of a YAML text begins."""
    return [0, *(match.end() for match in _BREAK.finditer(text))]


def apply_edits(text: str, edits: Sequence[Edit]) -> str | None:
    """Return the edited text, None if two edits overlap or an edit is outside the text."""
    starts = line_starts(text)
    newline = "\r\n" if "\r\n" in text else "\n"
    pieces: list[tuple[int, int, str]] = []
    for edit in edits:
        span, new = edit.span, edit.text.replace("\n", newline)
        if (
            span.line == len(starts) + 1 and span.column == 1
        ):  # after a last line without a line break
            pieces.append((len(text), len(text), newline + new.removesuffix(newline)))
            continue
        if span.end_line > len(starts):
            return None
        begin, end = (
            starts[span.line - 1] + span.column - 1,
            starts[span.end_line - 1] + span.end_column - 1,
        )
        quote = text[begin : begin + 1] if end - begin > 1 and text[begin] == text[end - 1] else ""
        pieces.append((begin, end, f"{quote}{new}{quote}" if quote in {"'", '"'} else new))
    pieces.sort()
    if any(end > begin for (_, end, _), (begin, _, _) in pairwise(pieces)):
        return None
    for begin, end, new in reversed(pieces):
        text = text[:begin] + new + text[end:]
    return text


def nearest(text: str, names: Iterable[str], cutoff: float = 0.61) -> str | None:
    """Return the most similar name, None if no name is similar enough.

    ``cutoff`` is the minimum similarity; 1 means equal.
    """
    import difflib

    matches = difflib.get_close_matches(
        text.lower(), {name.lower(): name for name in names}, n=1, cutoff=cutoff
    )
    return next((name for name in names if name.lower() == matches[0]), None) if matches else None


def slip_of(name: str, names: Iterable[str]) -> str | None:
    """Return the only name that differs by a single typing error, or None."""
    near = slips_of(name, names)
    return near[0] if len(near) == 1 else None


#: If more names than this are equally near, only one is proposed.
_MOST_NEAR = 3


def slips_of(text: str, names: Iterable[str]) -> list[str]:
    """Return the names that differ by a single typing error.

    This is a different case, or else a letter that is added, missing, wrong, or swapped with its
    neighbour.
    """
    candidates = [name for name in names if name != text]
    cased = [name for name in candidates if name.lower() == text.lower()]
    return cased or [name for name in candidates if len(text) > 1 and _is_one_slip(text, name)]


def _is_one_slip(a: str, b: str) -> bool:
    if abs(len(a) - len(b)) > 1:
        return False
    same = next(
        (index for index, (x, y) in enumerate(zip(a, b, strict=False)) if x != y),
        min(len(a), len(b)),
    )
    a, b = a[same:], b[same:]
    swapped = a[1::-1] == b[:2] and a[2:] == b[2:] and len(a) > 1
    return a[1:] == b[1:] or a[1:] == b or a == b[1:] or swapped


def did_you_mean(name: str, candidates: Iterable[str], otherwise: str = "") -> str:
    """Return advice with the nearest names, or ``otherwise`` if no name is near."""
    names = list(dict.fromkeys(candidates))
    near = slips_of(name, names)
    if not 1 < len(near) <= _MOST_NEAR:
        near = [match for match in (nearest(name, names),) if match]
    if not near:
        return otherwise
    *leading, last = near
    return f"did you mean {' or '.join(filter(None, (', '.join(leading), last)))}?"
