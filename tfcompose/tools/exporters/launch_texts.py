"""Texts of a launch file, with parts that launch replaces when it starts."""

from __future__ import annotations

import re
from dataclasses import dataclass

_MARK = re.compile(r"\$\{(build_dir|params_file)\}")


@dataclass(frozen=True, slots=True)
class FilePath:
    """A file that the launch file finds relative to itself."""

    #: The path, relative to the plan's folder or to the launch file's folder. Empty means the
    #: folder itself.
    path: str = ""
    is_next_to_launch_file: bool = False


@dataclass(frozen=True, slots=True)
class FileContent:
    """The text of a file in the plan's folder."""

    path: str


@dataclass(frozen=True, slots=True)
class ArgumentValue:
    """A part of a text that launch replaces by the value of an argument."""

    name: str
    kind: str


@dataclass(frozen=True, slots=True)
class VariableValue:
    """A part of a text that launch replaces by the value of an environment variable."""

    name: str
    default: str | None


Text = tuple[str | FilePath | ArgumentValue | VariableValue, ...]
"""A text with what it inserts, in order; empty: the empty text."""


def text_of(text: str, params_file: FilePath | None = None) -> Text:
    """Split a text of the plan, and replace ``${build_dir}`` and ``${params_file}`` by paths."""
    parts: list[str | FilePath] = []
    end = 0
    for mark in _MARK.finditer(text):
        parts += [text[end : mark.start()]] if mark.start() > end else []
        path = params_file if mark[1] == "params_file" else FilePath()
        parts.append(mark[0] if path is None else path)
        end = mark.end()
    return (*parts, text[end:]) if text[end:] else tuple(parts)


@dataclass(frozen=True, slots=True)
class TypedText:
    """A parameter's text, and the type to which launch converts it."""

    text: Text
    #: The name of the type: bool, int, float or str.
    type: str
