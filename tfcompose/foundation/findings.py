"""Findings about a robot: a code, a message, a place and a way out.

One space of codes serves lint, guard and the live tools, so that a second publisher that was
predicted and one that was seen read alike. A code is never used again for something else.
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
    """A stretch of a file. Lines and columns count from 1; the end is exclusive."""

    file: str
    line: int = 1
    column: int = 1
    end_line: int = 1
    end_column: int = 1

    def __str__(self) -> str:
        return f"{self.file}:{self.line}:{self.column}"

    def holds(self, other: Span) -> bool:
        """Return whether the other stretch begins in this one."""
        begin, end = (self.line, self.column), (self.end_line, self.end_column)
        return self.file == other.file and begin <= (other.line, other.column) < end


@dataclass(frozen=True, slots=True)
class Note:
    """A further place, or fact, that belongs to a finding."""

    message: str
    span: Span | None = None


@dataclass(frozen=True, slots=True)
class Edit:
    """A stretch of a file and its replacement. An empty stretch inserts."""

    span: Span
    #: A scalar's value, which keeps its quotes, or YAML to write as it is.
    text: str


@dataclass(frozen=True, slots=True)
class Finding:
    """A fault in a file or a running tree, complete where it is made."""

    code: str
    name: str
    severity: Severity
    #: One line with the names and values involved, without advice.
    message: str
    #: None for an observation of a live tree.
    span: Span | None = None
    #: Other places of a conflict, and further facts.
    notes: tuple[Note, ...] = ()
    #: The advice.
    help: str = ""
    #: Together the one safe fix, where there is one.
    edits: tuple[Edit, ...] = ()

    @property
    def label(self) -> str:
        """Code and name: "TF808 process_failed"."""
        return f"{self.code} {self.name}"

    @property
    def sort_key(self) -> tuple[str, int, int, str, str]:
        """By place, then by code: the order in which findings are shown."""
        span = self.span or Span("")
        return (span.file, span.line, span.column, self.code, self.message)


@dataclass(frozen=True, slots=True)
class Allow:
    """A comment that allows findings with these codes, and why."""

    codes: tuple[str, ...]
    line: int
    reason: str
    span: Span
    #: The last line that it covers; 0: ``line`` alone.
    last: int = 0


class RejectedError(Exception):
    """Raised by a stage that cannot go on; it holds everything that the stage found, in order."""

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
    """Return the finding with its code's name, and its default severity if none is given."""
    known = CATALOGUE[code]
    return Finding(
        code,
        known.name,
        severity or known.severity,
        message=message,
        span=span,
        notes=tuple(notes),
        help=help,
        edits=tuple(edits),
    )


def without_duplicates(findings: Iterable[Finding]) -> list[Finding]:
    """Return each finding once, in order.

    Of those that differ in notes only, the first, with the notes of all.
    """
    first: dict[Finding, Finding] = {}
    for finding in findings:
        alone = replace(finding, notes=()) if finding.notes else finding
        before = first.setdefault(alone, finding)
        notes = dict.fromkeys((*before.notes, *finding.notes))
        if len(notes) > len(before.notes):
            first[alone] = replace(before, notes=tuple(notes))
    return list(first.values())


_BREAK = re.compile("\r\n|[\r\n\x85\u2028\u2029]")  # as YAML counts lines


def line_starts(text: str) -> list[int]:
    """Return where each line of a YAML text begins."""
    return [0, *(match.end() for match in _BREAK.finditer(text))]


def apply_edits(text: str, edits: Sequence[Edit]) -> str | None:
    """Return the text with the edits in it, or None where two of them meet or one lies outside."""
    starts = line_starts(text)
    newline = "\r\n" if "\r\n" in text else "\n"
    pieces: list[tuple[int, int, str]] = []
    for edit in edits:
        span, new = edit.span, edit.text.replace("\n", newline)
        if (
            span.line == len(starts) + 1 and span.column == 1
        ):  # behind a last line that does not end
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


def nearest(text: str, known: Iterable[str], cutoff: float = 0.61) -> str | None:
    """Return the known word that a person most likely meant by ``word``, or None.

    1 is as near as the word itself.
    """
    import difflib

    found = difflib.get_close_matches(
        text.lower(), {name.lower(): name for name in known}, n=1, cutoff=cutoff
    )
    return next((name for name in known if name.lower() == found[0]), None) if found else None


def slip_of(name: str, known: Iterable[str]) -> str | None:
    """Return the only known word that ``word`` is a slip of the pen away from, or None."""
    near = slips_of(name, known)
    return near[0] if len(near) == 1 else None


#: Of more words than this that are as near, one is proposed.
_MOST_NEAR = 3


def slips_of(text: str, known: Iterable[str]) -> list[str]:
    """Return the known words that ``text`` is a slip of the pen away from.

    That is: another case; or else one letter too many, too few, wrong, or changed for its
    neighbour.
    """
    others = [name for name in known if name != text]
    cased = [name for name in others if name.lower() == text.lower()]
    return cased or [name for name in others if len(text) > 1 and _is_one_slip(text, name)]


def _is_one_slip(a: str, b: str) -> bool:
    if abs(len(a) - len(b)) > 1:
        return False
    same = next(
        (at for at, (x, y) in enumerate(zip(a, b, strict=False)) if x != y), min(len(a), len(b))
    )
    a, b = a[same:], b[same:]
    swapped = a[1::-1] == b[:2] and a[2:] == b[2:] and len(a) > 1
    return a[1:] == b[1:] or a[1:] == b or a == b[1:] or swapped


def did_you_mean(name: str, known: Iterable[str], otherwise: str = "") -> str:
    """Return advice that names the nearest words, or ``otherwise`` if none is near."""
    names = list(dict.fromkeys(known))
    near = slips_of(name, names)
    if not 1 < len(near) <= _MOST_NEAR:
        near = [match for match in (nearest(name, names),) if match]
    if not near:
        return otherwise
    *others, last = near
    return f"did you mean {' or '.join(filter(None, (', '.join(others), last)))}?"
