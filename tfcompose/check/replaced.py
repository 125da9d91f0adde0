"""What an overlay, a profile or an including file replaced, as notes of the findings about the new values."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from tfcompose.findings import Finding, Note

if TYPE_CHECKING:
    from collections.abc import Iterable

    from tfcompose.findings import Span
    from tfcompose.load import Path, Source

_OF_AN_ENTRY = 2  # its section and its name


def with_replaced(found: Iterable[Finding], sources: Iterable[Source]) -> list[Finding]:
    """Return the findings; one that is about a value which replaced another has a note with the other's place."""
    overlaid = [source for source in sources if source.replaced]
    return [replace(one, notes=_with_notes(one, overlaid)) if overlaid else one for one in found]


def _with_notes(found: Finding, sources: Iterable[Source]) -> tuple[Note, ...]:
    notes = found.notes
    for source in sources:
        notes = (*notes, *_notes(found, {note.span for note in notes}, source))
    return notes


def _notes(found: Finding, known: set[Span | None], source: Source) -> list[Note]:
    """Return notes about the value at the finding's place; if none is there, about those of the entry as a whole."""
    exact, around = [], []
    for path, (old, *_) in source.replaced.items():
        now = source.exactly_at(path)
        if now is None or found.span is None or old in known:
            continue
        if now.holds(found.span) or found.span == source.at_key(path):
            exact.append(Note("it replaces this value", old))
        elif len(path) > _OF_AN_ENTRY and found.span in _places_of_entry(path[:_OF_AN_ENTRY], source):
            name = ".".join(map(str, path[_OF_AN_ENTRY:]))
            around.append(Note(f"{name} at {now} replaces this value", old))
    return exact or around


def _places_of_entry(entry: Path, source: Source) -> set[Span]:
    """Return where findings about the whole of an entry are placed: its key, and its parent."""
    return {source.at_key(entry), source.at((*entry, "parent"))}
