"""YAML text as plain data with the location of every key and value, from parser events.

PyYAML's own composer recurses in C, so a deeply nested text crashes the interpreter. This reader
keeps its own stack, and stops at a depth that no robot file reaches. Tags construct no objects and
run no code. An alias yields the same object as its anchor. So a text with exponentially many
aliases stays small, and code that reads the data can recognise a value that it has already read.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from itertools import islice
from typing import TYPE_CHECKING, Any

import yaml
from yaml.events import (
    AliasEvent,
    DocumentStartEvent,
    MappingEndEvent,
    MappingStartEvent,
    ScalarEvent,
    SequenceEndEvent,
    SequenceStartEvent,
)

from tfcompose.foundation.findings import Finding, Note, RejectedError, Span, finding
from tfcompose.spec.load.scalars import MAP, NOT_FINITE, SCALAR_TAGS, SEQ, STR, TAG, plain, scalar
from tfcompose.spec.load.syntax import no_character, no_syntax

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping


DEEPEST = 40
MOST_VALUES = 400_000  # including values inside aliases

#: NUL, which file names, arguments and environment variables cannot contain, and lone surrogates,
#: which files cannot contain.
_FORBIDDEN = re.compile("[\0\ud800-\udfff]")

#: A key that contains the beginning of its value: ``mast {parent``, ``mast:{parent``.
_GLUED = re.compile(r"([\w/.-]+)\s*(:)?\s*([{\[].*)")

_LOADER: Any = getattr(yaml, "CBaseLoader", yaml.BaseLoader)

#: Error of PyYAML 6.0.4's C parser at 1,000 levels. An opening bracket may begin a key, so the
#: parser reads ahead to the end of the line, or for 1,024 characters, before it yields the
#: bracket. It can therefore fail before it has yielded ``DEEPEST`` levels.
_TOO_DEEP = "exceeded maximum nesting depth"
_READ_AHEAD = 900  # characters: 1,024, less room for more than ``DEEPEST`` brackets


def parse_events(text: str) -> Iterator[Any]:
    """Yield the parser's events.

    If PyYAML rejects a text as too deep, more than ``DEEPEST`` levels are yielded first. A reader
    that stops at ``DEEPEST`` therefore stops at the same place with every version of PyYAML.

    Raises:
        yaml.YAMLError: if it is not YAML.
    """
    count = 0
    try:
        for event in yaml.parse(text, Loader=_LOADER):
            count += 1
            yield event
    except yaml.MarkedYAMLError as error:
        if error.problem != _TOO_DEEP or error.problem_mark is None:
            raise
        # After a line break, no earlier bracket can begin a key, so the parser yields them all.
        end = error.problem_mark.index - _READ_AHEAD
        try:
            yield from islice(
                yaml.parse(f"{text[:end]}\n{text[end:]}", Loader=_LOADER), count, None
            )
        except yaml.MarkedYAMLError as second_error:
            second_error.problem_mark = error.problem_mark  # without the line break
            raise


@dataclass(slots=True)
class _Part:
    """A complete value with an anchor."""

    value: Any
    location: Location
    #: Number of values, itself included.
    size: int = 1
    #: Number of nested levels; 0 for a scalar.
    height: int = 0
    #: Findings inside the value.
    findings: list[Finding] = field(default_factory=list)


@dataclass(slots=True)
class _Open:
    """A mapping or list whose content is being read."""

    data: Any
    start: yaml.CollectionStartEvent
    is_mapping: bool
    is_root: bool
    found_before: int
    waits_for_key: bool
    inside: dict[str | int, Location] = field(default_factory=dict)
    keys: dict[str, Location] = field(default_factory=dict)
    merges: tuple[tuple[Any, Location], ...] = ()
    size: int = 1
    height: int = 0
    #: The key of the next value.
    key: str = ""
    is_merge: bool = False
    #: Whether to keep the next value.
    keeps: bool = True
    found_before_value: int = 0

    def is_aside(self, key: str) -> bool:
        """Return whether this is a top-level ``x-`` key, which only serves to hold anchors."""
        return self.is_root and key.startswith("x-")


class DocumentReader:
    """Reads the documents of a text."""

    def __init__(self, file: str) -> None:
        self.file = file
        #: Faults of the text.
        self.findings: list[Finding] = []
        #: Whether a value is null.
        self.has_nulls = False
        self.documents: list[tuple[Any, Location]] = []
        self._anchors: dict[str, _Part | None] = {}
        self._stack: list[_Open] = []
        self._values = 0
        self._size = 0

    def read(self, text: str, *, single: bool = True) -> None:
        """Read the text; with ``single``, a second document is an error.

        Raises:
            RejectedError: if the text is not YAML, too deep or too large.
        """
        try:
            for event in parse_events(text):
                kind = type(event)
                if kind is ScalarEvent:  # the most frequent kind
                    self._scalar(event)
                elif kind is MappingStartEvent or kind is SequenceStartEvent:
                    self._open(event, is_mapping=kind is MappingStartEvent)
                elif kind is MappingEndEvent or kind is SequenceEndEvent:
                    self._close(event)
                elif kind is AliasEvent:
                    self._alias(event)
                elif kind is DocumentStartEvent:
                    self._begin(event, single=single)
        except yaml.MarkedYAMLError as error:
            raise RejectedError(no_syntax(error, text, self.file)) from None
        except yaml.reader.ReaderError as error:
            raise RejectedError([no_character(error, text, self.file)]) from None
        except UnicodeEncodeError as error:
            message = f"the text is not Unicode: {error.reason}"
            raise RejectedError([finding("TF001", message, Span(self.file))]) from None
        self.findings = list(
            dict.fromkeys(self.findings)
        )  # an alias repeats its anchor's findings

    def _begin(self, event: yaml.Event, *, single: bool) -> None:
        self._anchors = {}
        if single and self.documents:
            message = "a second document begins here; a robot is one document"
            raise RejectedError([finding("TF002", message, self._location_of(event).span)])

    def _location_of(self, event: yaml.Event) -> Location:
        return Location(_between(self.file, event.start_mark, event.end_mark))

    def _refuse(self, message: str, location: Location) -> RejectedError:
        return RejectedError([*self.findings, finding("TF008", message, location.span)])

    def _scalar(self, event: yaml.ScalarEvent) -> None:
        location = Location(_between(self.file, event.start_mark, event.end_mark))
        before = len(self.findings)
        value = self.value_of(event, location)
        if event.anchor:
            self._anchors[event.anchor] = _Part(value, location, findings=self.findings[before:])
        top = self._stack[-1] if self._stack else None
        if top is not None and top.waits_for_key:
            del self.findings[before:]
            key = value if isinstance(value, str) and event.tag in {None, "!", STR} else None
            is_merge = key == "<<" and event.implicit[0]
            self._key(top, key, location, "a number, true, false or null", is_merge=is_merge)
        else:
            self._put(value, location, 1, 0)

    def value_of(self, event: yaml.ScalarEvent, location: Location) -> Any:
        """Return a scalar's value, and record its faults.

        Raises:
            RejectedError: if it contains a character that is forbidden in text.
        """
        tag, text = event.tag, event.value
        try:
            if event.implicit[0] and (tag is None or tag == "!"):
                value: Any = plain(text)
                self.has_nulls = self.has_nulls or value is None
                return value
            if _FORBIDDEN.search(text):  # as an escape sequence
                raise RejectedError(
                    [finding("TF002", "a character that no text can hold", location.span)]
                )
            if tag is None or tag in {"!", STR}:
                return text
            return self.read_tagged(tag, text, location)
        except OverflowError as error:
            if text.lower() in NOT_FINITE and self._is_parameter():
                return NOT_FINITE[text.lower()]
            self.findings.append(
                finding(
                    "TF007",
                    str(error),
                    location.span,
                    help="give a finite number; only a node's params may be .inf or .nan",
                )
            )
            return 1.0  # valid as size, mass or axis, so that the fault is reported once

    def _is_parameter(self) -> bool:
        """Return whether the current value is below the parameters of a node."""
        keys = [part.key for part in self._stack]
        match keys[2:] if keys[:1] == ["profiles"] else keys:
            case (
                ["processes" | "containers", _, "params", *_]
                | ["processes" | "containers", _, "nodes", _, "params", *_]
                | ["sensors", _, "driver", "params", *_]
            ):
                return True
        return False

    def read_tagged(self, tag: str, text: str, location: Location) -> Any:
        """Return the value of a scalar with a tag, and record its faults."""
        if tag not in SCALAR_TAGS:
            self._unknown_tag(tag, location)
            return text
        try:
            value = scalar(tag, text)
        except ValueError as error:
            self.findings.append(
                finding("TF005", str(error), location.span, help="leave the tag out")
            )
            return text
        self.has_nulls = self.has_nulls or value is None
        return value

    def _unknown_tag(self, tag: str, location: Location) -> None:
        message = f"unknown tag {tag.replace(TAG, '!!')}"
        self.findings.append(
            finding("TF005", message, location.span, help="tags are not used: leave it out")
        )

    def _open(self, event: yaml.CollectionStartEvent, *, is_mapping: bool) -> None:
        if len(self._stack) >= DEEPEST:
            raise self._refuse(f"nested deeper than {DEEPEST} levels", self._location_of(event))
        data: Any = {} if is_mapping else []
        self._stack.append(
            _Open(data, event, is_mapping, not self._stack, len(self.findings), is_mapping)
        )
        if event.anchor:
            self._anchors[event.anchor] = None
        if event.tag is not None and event.tag not in {"!", MAP if is_mapping else SEQ}:
            self._unknown_tag(event.tag, self._location_of(event))

    def _close(self, event: yaml.Event) -> None:
        done = self._stack.pop()
        for value, location in done.merges:
            self._inherit(done, value, location)
        location = Location(
            _between(self.file, done.start.start_mark, event.end_mark), done.inside, done.keys
        )
        self._size += 0 if self._stack else done.size
        if done.size > MOST_VALUES or self._size > MOST_VALUES:
            raise self._refuse(
                f"more than {MOST_VALUES:,} values once aliases are followed", location
            )
        if done.start.anchor:
            findings = self.findings[done.found_before :]
            self._anchors[done.start.anchor] = _Part(
                done.data, location, done.size, done.height, findings
            )
        top = self._stack[-1] if self._stack else None
        if top and top.waits_for_key:
            del self.findings[done.found_before :]
            self._key(top, None, location, "a list or a mapping")
        else:
            self._put(done.data, location, done.size, done.height)

    def _inherit(self, done: _Open, value: Any, location: Location) -> None:
        """Add the keys of the mappings that ``<<`` names, except those that are already set.

        If several of the mappings have a key, the first one wins.
        """
        steps = enumerate(value) if isinstance(value, list) else [(None, value)]
        for index, source in steps:
            inner = location if index is None else location.inside[index]
            if not isinstance(source, dict):
                message = "<< takes a mapping, or a list of mappings"
                self.findings.append(finding("TF011", message, inner.span))
                continue
            for key, item in source.items():
                if key not in done.data and not done.is_aside(key):
                    done.data[key], done.inside[key], done.keys[key] = (
                        item,
                        inner.inside[key],
                        inner.keys[key],
                    )

    def _alias(self, event: yaml.AliasEvent) -> None:
        if event.anchor not in self._anchors:
            message = f"no anchor &{event.anchor} is defined before this alias"
            raise RejectedError([finding("TF002", message, self._location_of(event).span)])
        part = self._anchors[event.anchor]
        if part is None or len(self._stack) + part.height > DEEPEST:
            why = (
                f"nested deeper than {DEEPEST} levels"
                if part
                else "an alias is inside the value that it names"
            )
            raise self._refuse(why, self._location_of(event))
        top = self._stack[-1]
        if top.waits_for_key:
            key = part.value if isinstance(part.value, str) else None
            self._key(top, key, self._location_of(event), "not a string")
        else:
            self.findings += part.findings
            self._put(part.value, part.location, part.size, part.height)

    def _key(
        self,
        top: _Open,
        key: str | None,
        location: Location,
        what: str = "",
        *,
        is_merge: bool = False,
    ) -> None:
        """Record a key; values of invalid, duplicate and top-level ``x-`` keys are dropped."""
        top.key, top.waits_for_key, top.is_merge, top.keeps = key or "", False, is_merge, True
        if key is None:
            message = f"a key must be a string; this one is {what}"
            self.findings.append(finding("TF004", message, location.span, help="put it in quotes"))
            top.keeps = False
        elif not key.isascii() and key.strip() != key:
            message = (
                "a key begins or ends with a space that YAML does not recognise, such as a"
                " no-break space"
            )
            self.findings.append(
                finding("TF002", message, location.span, help="replace it with an ordinary space")
            )
            top.keeps = False
        elif ("{" in key or "[" in key) and (glued := _GLUED.match(key)):
            message = (
                f"a space after the colon of {glued[1]} is missing"
                if glued[2]
                else f"{glued[1]} has no colon"
            )
            advice = f"write {glued[1]}: {glued[3] if glued[3][-1] in '}]' else glued[3][0] + '…'}"
            self.findings.append(finding("TF002", message, location.span, help=advice))
            top.keeps = False
        elif key in top.keys:
            note = Note("first defined here", top.keys[key].span)
            self.findings.append(
                finding(
                    "TF003",
                    f"the key {key} is given twice",
                    location.span,
                    notes=[note],
                    help="remove one of the two, or rename it",
                )
            )
            top.keeps = False
        else:
            top.keys[key] = location
            top.keeps = not (top.is_root and top.is_aside(key))
        top.found_before_value = len(self.findings)

    def _put(self, value: Any, location: Location, size: int, height: int) -> None:
        """Add a complete value to the mapping or list that contains it."""
        if not self._stack:
            self.documents.append((value, location))
            return
        top = self._stack[-1]
        top.size += size
        if height >= top.height:
            top.height = height + 1
        if not top.is_mapping:
            top.inside[len(top.data)] = location
            top.data.append(value)
            return
        top.waits_for_key = True
        if not top.keeps:
            del self.findings[top.found_before_value :]
        elif top.is_merge:
            top.merges += ((value, location),)
        else:
            top.data[top.key], top.inside[top.key] = value, location


def _between(file: str, start: Any, end: Any) -> tuple[str, int, int, int, int]:
    """Return the file, and lines and columns counted from 0.

    Plain numbers allow Python to free the parser's marks.
    """
    return file, start.line, start.column, end.line, end.column


Path = tuple[str | int, ...]

_NOTHING: Mapping[Any, Any] = {}


class Location:
    """The location of a value, and of the keys and items in it.

    Most locations are never used, so ``span`` creates its ``Span`` on first use. Locations are
    immutable. ``inside`` has the locations of values by key or index, and ``keys`` the locations
    of keys. An alias has the location of its anchor.
    """

    __slots__ = ("_at", "inside", "keys")

    def __init__(
        self,
        place: Span | tuple[str, int, int, int, int],
        inside: Mapping[Any, Location] = _NOTHING,
        keys: Mapping[Any, Location] = _NOTHING,
    ) -> None:
        """Create a location from a span, or from a file and both ends' line and column from 0."""
        self._at = place
        self.inside = inside
        self.keys = keys

    @property
    def span(self) -> Span:
        """The span in the file."""
        place = self._at
        if isinstance(place, Span):
            return place
        file, line, column, end_line, end_column = place
        self._at = span = Span(file, line + 1, column + 1, end_line + 1, end_column + 1)
        return span

    def with_inside(
        self, inside: Mapping[Any, Location], keys: Mapping[Any, Location]
    ) -> Location:
        """Return a location with the same span, and with other locations inside."""
        return Location(self._at, inside, keys)

    def get(self, path: Path) -> Location | None:
        """Return the location of the value at ``path``, or None."""
        location: Location | None = self
        for step in path:
            if location is None:
                break
            location = location.inside.get(step)
        return location

    def nearest(self, path: Path) -> Location:
        """Return the location at ``path``, or of the nearest enclosing value."""
        location = self
        for step in path:
            below = location.inside.get(step)
            if below is None:
                break
            location = below
        return location

    def nearest_key(self, path: Path) -> Location | None:
        """Return the location of the last key on ``path`` that exists, or None."""
        location = self
        key: Location | None = None
        for step in path:
            key = location.keys.get(step, key)
            below = location.inside.get(step)
            if below is None:
                break
            location = below
        return key

    def walk(self, path: Path = ()) -> Iterator[tuple[Path, Location]]:
        """Yield the path and location of every value, this one first."""
        yield path, self
        for step, location in self.inside.items():
            yield from location.walk((*path, step))
