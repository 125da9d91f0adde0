"""Records of the processes that launch files start, the same for each reader.

This runs in the process that reads launch files (``launch_process``).
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

#: As what the folder of a package begins that is not found.
PACKAGE = "package://"
#: Numbers of actions in records; Python reuses an ``id`` once an action is gone.
IDS = itertools.count(1)


class FailedError(Exception):
    """A part of a launch file cannot be resolved.

    ``line`` is set if the error is about a whole file, else 0.
    """

    def __init__(self, reason: str, line: int = 0) -> None:
        super().__init__(f"line {line}: {reason}" if line else reason)
        self.reason, self.line = reason, line


class LaunchRecording:
    """The resolved contents of a launch file.

    ``records`` has them in order.
    """

    def __init__(
        self, find: Callable[[str, str], str | None], *, every_branch: bool = False
    ) -> None:
        self.find, self.every_branch = find, every_branch
        self.records: list[dict[str, Any]] = []
        #: The file and line of what is read now.
        self.at: tuple[str, int] = ("", 1)
        self.conditions: list[str] = []
        self.whens: list[str] = []
        self.period_s = 0.0
        self.after: dict[str, str] = {}
        #: The types of launch arguments that a robot file can have as its own, by name.
        self.declared: dict[str, str] = {}
        #: Those whose value decided something that stands in the robot file as it is now.
        self.decided: set[str] = set()
        self.depth = 0
        #: The texts of files that launch or its file makes, by the paths that stand for them.
        self.files: dict[str, str] = {}

    def here(self) -> tuple[str, int]:
        """Return the file and line being read."""
        return self.at

    def record(self, kind: str, at: Any, **what: Any) -> None:
        """Record an action."""
        more: dict[str, Any] = {"when": list(self.conditions)} if self.conditions else {}
        more |= {"only_when": " and ".join(dict.fromkeys(self.whens))} if self.whens else {}
        self.records.append({"kind": kind, "at": at, **more, **what})

    def file_of_text(self, source: str, text: str) -> str:
        """Keep the text of a file that launch writes; return its placeholder path."""
        source = os.path.abspath(source)  # noqa: PTH100 (links stay)
        begin = source.rpartition("#")[0] if source in self.files else source
        for number in itertools.count(1):
            path = f"{begin}#{number}"
            if self.files.setdefault(path, text) == text:
                return path
        raise AssertionError

    def todo(self, at: Any, text: str) -> None:
        """Record a part of a launch file that is not resolved."""
        self.record("todo", at, text=shown(text))

    def declare(self, name: str, value: str) -> None:
        """Register an argument that the robot file may declare too."""
        kinds = {bool: "bool", int: "int", float: "float", str: "string"}
        if re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", name):
            self.declared[name] = kinds[type(scalar_of(value))]

    def argument_kept(self, name: str, value: str, *, typed: bool = False) -> bool:
        """Return whether a reference to the argument can replace its value.

        Otherwise the value is written, and it is fixed. ``typed``: it may be 10.0, which texts
        lose.
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
    """Return a launch argument's value: a bool, a number as written, or the text."""
    if text.lower() in {"true", "false"}:
        return text.lower() == "true"
    if re.fullmatch(r"-?(0|[1-9][0-9]{0,15})", text) and text != "-0":
        return int(text)
    if re.fullmatch(r"-?(0|[1-9][0-9]*)\.[0-9]+", text) and repr(float(text)) == text:
        return float(text)
    return text


def conjunction(parts: Iterable[str | None], separator: str) -> str | None:
    """Return the conjunction of conditions of a robot file, None if one cannot be expressed."""
    conditions = list(parts)
    if not all(conditions):
        return None
    return separator.join(f"({condition})" for condition in conditions)


# Texts of files, while the launch file has them in its hands

_FILES: dict[str, FileText] = {}
_PLACEHOLDER = re.compile(r'(<robot name="tfcompose_text_\d+"/>)')


def placeholder(file: str, args: dict[str, str] | None = None) -> str:
    """Return a description that a launch file can pass on instead of a file's text."""
    text = f'<robot name="tfcompose_text_{len(_FILES)}"/>'
    _FILES[text] = FileText(with_package(file), args or {})
    return text


def with_files(text: str) -> str:
    """Return a text with the placeholders in it replaced by their files, as parts."""
    return Text.of(part for known in parts_of(text) for part in _split(known))


def _split(part: Part) -> Iterable[Part]:
    if not isinstance(part, str):
        return [part]
    return [_FILES.get(piece, piece) for piece in _PLACEHOLDER.split(part)]


def shown(text: str) -> str:
    """Return a text for display, with the names of files instead of their texts."""
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
    """Return a path below a missing package as an address.

    pathlib reduces two slashes to one.
    """
    if "package:/" not in path or isinstance(path, Text):
        return path
    return re.sub(r"^.*?package:/+", PACKAGE, path)


def of_command(argv: list[str], text: str) -> str:
    """Return the placeholder for the output of a command that makes a robot's description.

    Raises:
        FailedError: for any other command: none is run.
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
    """Return a path for display, relative to the folder of the import."""
    return os.path.relpath(text) if os.path.isabs(text) and os.path.exists(text) else text  # noqa: PTH110, PTH117
