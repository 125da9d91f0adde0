"""Texts with parts that are known only when the robot is built.

A launch argument may have another value when the robot is built. The import does not read the text
of a file; it only keeps the file's name.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True, slots=True)
class Argument:
    """An argument of the robot file, and its value in the source."""

    name: str
    value: str


@dataclass(frozen=True, slots=True)
class FileText:
    """The text of a file, or its expansion by xacro with arguments."""

    file: str
    args: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class MadeFile:
    """The path, relative to the robot file, of a file that the import writes."""

    file: str


Part = str | Argument | FileText | MadeFile


class Text(str):
    """A text that contains arguments or files' texts.

    As a plain ``str``, a Text contains the value of each argument, and the name of each file
    instead of its text.
    """

    __slots__ = ("parts",)
    parts: tuple[Part, ...]

    @staticmethod
    def of(parts: Iterable[Part]) -> str:
        """Return the text of these parts; it is a plain ``str`` if all parts are known."""
        merged: list[Part] = []
        for part in parts:
            if isinstance(part, str) and merged and isinstance(merged[-1], str):
                merged[-1] += part
            elif part != "":
                merged.append(part)
        values = "".join(map(_value, merged))
        if all(isinstance(part, str) for part in merged):
            return values
        text = Text(values)
        text.parts = tuple(merged)
        return text


def _value(part: Part) -> str:
    match part:
        case Argument(value=value):
            return value
        case FileText(file=file) | MadeFile(file=file):
            return file
    return part


def parts_of(text: str) -> tuple[Part, ...]:
    """Return the parts of a text; a plain text is its only part."""
    return text.parts if isinstance(text, Text) else (text,)


def fill(text: str, kind: type[Argument | FileText]) -> str:
    """Return a text with its arguments, or its files' texts, replaced by their plain ``str``."""
    return Text.of(_fill(part, kind) for part in parts_of(text))


def _fill(part: Part, kind: type[Argument | FileText]) -> Part:
    return _value(part) if isinstance(part, kind) else part


def concatenate(texts: Iterable[str], separator: str = "") -> str:
    """Return the texts joined by a separator."""
    parts: list[Part] = []
    for index, text in enumerate(texts):
        parts += [separator] if index else []
        parts += parts_of(text)
    return Text.of(parts)


def partition(text: str, separator: str) -> tuple[str, str, str]:
    """Return the text before a separator, the separator, and the rest, as ``str.partition``."""
    parts = parts_of(text)
    for index, part in enumerate(parts):
        if isinstance(part, str) and separator in part:
            before, _, behind = part.partition(separator)
            left, right = (*parts[:index], before), (behind, *parts[index + 1 :])
            return Text.of(left), separator, Text.of(right)
    return text, "", ""


def words_of(text: str) -> list[str]:
    """Split a command line with shell quotes into words.

    An argument never splits a word, even if its value contains spaces.
    """
    fields: list[list[Part]] = []
    quote, is_open, is_escaped = "", False, False
    for item in _characters(text):
        is_quote = not is_escaped and item in {quote or "'", quote or '"'}
        is_escape = not is_escaped and not quote and item == "\\"
        if isinstance(item, str) and item.isspace() and not quote and not is_escaped:
            is_open = False
            continue
        if not is_open:
            fields.append([])
            is_open = True
        if is_quote:
            quote = "" if quote else str(item)
        elif not is_escape:
            fields[-1].append(item)
        is_escaped = is_escape
    return [Text.of(parts) for parts in fields]


def _characters(text: str) -> Iterator[Part]:
    for part in parts_of(text):
        if isinstance(part, str):
            yield from part
        else:
            yield part


def argument_of(text: Any) -> Argument | None:
    """Return the argument, if the text consists only of an argument; else None."""
    match text:
        case Text(parts=(Argument() as argument,)):
            return argument
    return None


def arguments_in(value: Any) -> set[str]:
    """Return the names of the arguments in data."""
    texts = filter(lambda text: isinstance(text, Text), texts_in(value))
    return {part.name for text in texts for part in parts_of(text) if isinstance(part, Argument)}


def texts_in(value: Any) -> Iterator[str]:
    """Yield the texts in data, without the keys of mappings."""
    if isinstance(value, str):
        yield value
    elif isinstance(value, Mapping):
        for item in value.values():
            yield from texts_in(item)
    elif isinstance(value, (list, tuple)):
        for item in value:
            yield from texts_in(item)


def files_in(text: Any) -> list[FileText]:
    """Return the files whose texts are in a text."""
    parts = parts_of(text) if isinstance(text, str) else ()
    return [part for part in parts if isinstance(part, FileText)]


_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*", re.ASCII)
#: The JSON schema of a text: a string, or the list of its parts.
SHAPE: tuple[Any, ...] = (
    str,
    {"parts": [(str, {"argument": str, "value": str}, {"file": str, "args": {"*": str}})]},
)


def as_json(text: str) -> Any:
    """Return a text as JSON data."""
    if not isinstance(text, Text):
        return text
    return {"parts": list(map(_part_as_json, text.parts))}


def _part_as_json(part: Part) -> Any:
    match part:
        case Argument(name=name, value=value):
            return {"argument": name, "value": value}
        case FileText(file=file, args=args):
            return {"file": file, "args": dict(args)}
    return part


def from_json(value: Any) -> Any:
    """Return the text for JSON data that fits ``SHAPE``; return other values unchanged."""
    if isinstance(value, dict):
        return Text.of(map(_part_from_json, value["parts"]))
    return value


def _part_from_json(part: Any) -> Part:
    if isinstance(part, str):
        return part
    if "argument" in part:
        if not _NAME.fullmatch(part["argument"]):
            return str(part["value"])
        return Argument(part["argument"], part["value"])
    return FileText(part["file"], part["args"])
