"""Records of the processes that a launch file starts.

The readers for ROS 1 and ROS 2 write the same records. This module runs in the process that reads
launch files (``launch_process``).
"""

from __future__ import annotations

import itertools
import os
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tfcompose.tools.importers.texts import FileText, Part, Text, as_json, parts_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

#: The beginning of the address that replaces the folder of a missing package.
PACKAGE = "package://"
#: Numbers that identify actions in records. Python's ``id`` cannot be used, because Python reuses
#: it after it deletes an action.
IDS = itertools.count(1)


class FailedError(Exception):
    """A part of a launch file cannot be resolved.

    If the error is about a whole file, ``line`` is its line in the file; else it is 0.
    """

    def __init__(self, reason: str, line: int = 0) -> None:
        super().__init__(f"line {line}: {reason}" if line else reason)
        self.reason, self.line = reason, line


class LaunchRecording:
    """The contents of a launch file, as ``records`` in the order of the file."""

    def __init__(
        self, find: Callable[[str, str], str | None], *, every_branch: bool = False
    ) -> None:
        self.find, self.every_branch = find, every_branch
        self.records: list[dict[str, Any]] = []
        #: The file and line that is being read.
        self.place: tuple[str, int] = ("", 1)
        self.conditions: list[str] = []
        self.whens: list[str] = []
        self.period_s = 0.0
        self.after: dict[str, str] = {}
        #: The types of launch arguments that can become arguments of the robot file, by name.
        self.declared: dict[str, str] = {}
        #: Launch arguments whose current value determined a part of the robot file.
        self.decided: set[str] = set()
        self.depth = 0
        #: The texts of files that launch or the launch file creates, by placeholder path.
        self.files: dict[str, str] = {}

    def here(self) -> tuple[str, int]:
        """Return the file and line being read."""
        return self.place

    def record(self, kind: str, place: Any, **what: Any) -> None:
        """Record an action."""
        more: dict[str, Any] = {"when": list(self.conditions)} if self.conditions else {}
        more |= {"only_when": " and ".join(dict.fromkeys(self.whens))} if self.whens else {}
        self.records.append({"kind": kind, "at": place, **more, **what})

    def file_of_text(self, source: str, text: str) -> str:
        """Keep the text of a file that launch would write; return its placeholder path."""
        source = os.path.abspath(source)  # noqa: PTH100 (links stay)
        begin = source.rpartition("#")[0] if source in self.files else source
        for number in itertools.count(1):
            path = f"{begin}#{number}"
            if self.files.setdefault(path, text) == text:
                return path
        raise AssertionError

    def todo(self, place: Any, text: str) -> None:
        """Record a part of a launch file that cannot be resolved."""
        self.record("todo", place, text=display_text(text))

    def declare(self, name: str, value: str) -> None:
        """Register a launch argument that can become an argument of the robot file."""
        kinds = {bool: "bool", int: "int", float: "float", str: "string"}
        if re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", name):
            self.declared[name] = kinds[type(scalar_of(value))]

    def argument_kept(self, name: str, value: str, *, typed: bool = False) -> bool:
        """Return whether a reference to the argument can replace its value.

        If it cannot, the robot file gets the value, and the argument is fixed. ``typed``: a value
        such as 10.0 can be replaced, because the reference keeps the type.
        """
        if name not in self.declared:
            return False
        scalar = scalar_of(value)
        is_kept = str(scalar).lower() == value  # True would become true
        if isinstance(scalar, float) and scalar.is_integer() and not typed:
            is_kept = False  # 10.0 would become 10
        if is_kept or self.declared[name] == "string":
            return True
        self.decided.add(name)
        return False


def scalar_of(text: str) -> Any:
    """Return a launch argument's value: a bool, a number, or the text."""
    if text.lower() in {"true", "false"}:
        return text.lower() == "true"
    if re.fullmatch(r"-?(0|[1-9][0-9]{0,15})", text) and text != "-0":
        return int(text)
    if re.fullmatch(r"-?(0|[1-9][0-9]*)\.[0-9]+", text) and repr(float(text)) == text:
        return float(text)
    return text


def conjunction(parts: Iterable[str | None], separator: str) -> str | None:
    """Join conditions of a robot file; return None if one of them is None."""
    conditions = list(parts)
    if not all(conditions):
        return None
    return separator.join(f"({condition})" for condition in conditions)


# Placeholders for the texts of files

_FILES: dict[str, FileText] = {}
_PLACEHOLDER = re.compile(r'(<robot name="tfcompose_text_\d+"/>)')


def placeholder(file: str, args: dict[str, str] | None = None) -> str:
    """Return a placeholder that a launch file can pass on instead of a file's text."""
    text = f'<robot name="tfcompose_text_{len(_FILES)}"/>'
    _FILES[text] = FileText(with_package(file), args or {})
    return text


def with_files(text: str) -> str:
    """Return a ``Text`` in which each placeholder is replaced by its file."""
    return Text.of(part for piece in parts_of(text) for part in _split(piece))


def _split(part: Part) -> Iterable[Part]:
    if not isinstance(part, str):
        return [part]
    return [_FILES.get(piece, piece) for piece in _PLACEHOLDER.split(part)]


def display_text(text: str) -> str:
    """Return a readable text, with the names of files instead of their texts."""
    return str(with_files(text))


def jsonable(value: Any) -> Any:
    """Return a record's value as JSON data."""
    if isinstance(value, str):
        return as_json(with_files(value))
    if isinstance(value, dict):
        return {str(with_files(str(key))): jsonable(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [jsonable(item) for item in value]
    return value


# Paths and commands


def with_package(path: str) -> str:
    """Return a path below a missing package as a ``package://`` address.

    pathlib turns the two slashes of such an address into a single slash; this restores them.
    """
    if "package:/" not in path or isinstance(path, Text):
        return path
    return re.sub(r"^.*?package:/+", PACKAGE, path)


def of_command(argv: list[str], text: str) -> str:
    """Return the placeholder for the output of a command that writes a description.

    Raises:
        FailedError: for any other command, because the import runs no commands.
    """
    program = Path(argv[0]).name if argv else ""
    rest = [with_package(argument) for argument in argv[1:]]
    if program.startswith("xacro") or argv[:3] == ["ros2", "run", "xacro"]:
        rest = rest[3:] if program == "ros2" else rest
        files = [
            argument for argument in rest if ":=" not in argument and not argument.startswith("-")
        ]
        args = dict(argument.split(":=", 1) for argument in rest if ":=" in argument)
        if files:
            return placeholder(files[0], args)
    if program == "cat" and len(rest) == 1:
        return file_text(rest[0])
    raise FailedError(f"the command {text.strip()} is not run")


def file_text(path: str) -> str:
    """Return the text of a file, or a placeholder if its package is not found.

    Raises:
        FailedError: if the file cannot be read.
    """
    if path.startswith(PACKAGE):
        return placeholder(path)
    try:
        return Path(path).read_text("utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise FailedError(f"{path} cannot be read: {error}") from None


def relative(text: str) -> str:
    """Return a readable path, relative to the folder in which the import runs."""
    return os.path.relpath(text) if os.path.isabs(text) and os.path.exists(text) else text  # noqa: PTH110, PTH117
