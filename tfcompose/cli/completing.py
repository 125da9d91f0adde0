"""What a word of a command line can be.

Commands, options, their values, and names that the robot file has.
"""

from __future__ import annotations

import os
import re
import shlex
from typing import TYPE_CHECKING

from tfcompose.cli.command_parser import CommandModule, command_parser
from tfcompose.cli.documentation import topics
from tfcompose.cli.options import DEFAULT_FILE
from tfcompose.cli.plans import is_plan
from tfcompose.cli.reading import read_text
from tfcompose.cli.tool_commands import add_all_options, find
from tfcompose.foundation.findings import RejectedError

if TYPE_CHECKING:
    from argparse import Action
    from collections.abc import Callable, Iterable, Mapping, Sequence

YAML = (".yaml", ".yml")


#: Words in the help of arguments that take a file or a folder.
PATHS = frozenset({"FILE", "DIR", "FOLDER", "BAG", "PICTURE", "PLAN", "OLD", "NEW"})


def candidates(
    commands: Mapping[str, CommandModule], words: Sequence[str], at: int
) -> tuple[list[str], bool]:
    """Return what ``words[at]`` can be, and whether it can also be a file.

    ``words`` begins with the program's name, and the word may be half written.
    """
    if at < 1:
        return [], False
    word, before = (
        (words[at] if at < len(words) else ""),
        list(map(_expanded, words[1:at])),
    )
    if not before:
        return _beginning(word, [*commands, "--help", "--version"]), False
    if before[0] not in commands:
        return [], False
    if before == ["help"]:
        from tfcompose.spec.language.reference import keys, paths

        return _beginning(
            word, [*topics(), *commands, *(paths() if "." in word else keys())]
        ), False
    parser = command_parser(before[0], commands[before[0]])
    add_all_options(before[0], parser)
    actions = parser._actions  # noqa: SLF001 (argparse has no other way)
    options = {text: action for action in actions for text in action.option_strings}
    option, equals, value = word.partition("=")
    joined = options.get(option) if equals else None
    if joined is not None and joined.nargs != 0:
        return [
            f"{option}={one}" for one in _completed(value, _values(joined, before), joined)
        ], _is_path(joined)
    valued = options.get(before[-1])
    if valued is not None and valued.nargs != 0:
        return _completed(word, _values(valued, before), valued), _is_path(valued)
    if word.startswith("-"):
        return _beginning(word, options), False
    positionals = [one for one in actions if not one.option_strings]
    if (
        positionals
        and positionals[0].choices
        and positionals[0].nargs is None
        and len(before) == 1
    ):
        positionals = positionals[:1]  # the first word is needed
    known = [value for one in positionals for value in _values(one, before)]
    return _beginning(word, known), any(map(_is_path, positionals))


def split_line(line: str) -> list[str]:
    """Return the words of a command line up to the cursor.

    The last one may be empty, or its quotes still open.
    """
    for end in ("", "'", '"', "\\"):
        try:
            words = shlex.split(f"{line}{end}")
        except ValueError:
            continue
        return (
            [*words, ""]
            if not end and (not line or line[-1].isspace()) and not line.endswith("\\ ")
            else words
        )
    return []


def _expanded(word: str) -> str:
    return os.path.expanduser(word)  # noqa: PTH111 (where there is no such user it stays as it is)


def _is_path(action: Action) -> bool:
    return isinstance(action.metavar, str) and not PATHS.isdisjoint(
        re.findall("[A-Z]+", action.metavar)
    )


def _completed(word: str, known: Iterable[str], action: Action) -> list[str]:
    """Return what an option's value can be; of a list with commas, what its last part can be."""
    first, comma, last = word.rpartition(",") if action.metavar == "CODES" else ("", "", word)
    return [f"{first}{comma}{one}" for one in _beginning(last, known)]


def _beginning(word: str, known: Iterable[str]) -> list[str]:
    return [one for one in dict.fromkeys(known) if one.startswith(word)]


def _values(action: Action, before: Sequence[str]) -> list[str]:
    """Return the values of an argument, as far as they have names."""
    if action.choices is not None:
        return [str(one) for one in action.choices]
    if isinstance(action.metavar, str) and action.metavar.islower():
        return action.metavar.split("|")
    source = _SOURCES.get((before[0], action.dest)) or _SOURCES.get(("", action.dest))
    if source:
        return source(before)
    command = find(before[0])
    sections = dict(command.command.completes) if command else {}
    return _section(sections[action.dest], before) if action.dest in sections else []


def _frames(before: Sequence[str]) -> list[str]:
    """Return the frames of the robot file; before it is named, nothing: files are meant."""
    from tfcompose.cli.compiling import library
    from tfcompose.compiler.compile import compile_source
    from tfcompose.spec.load import load

    file = next((word for word in before if word.endswith(YAML)), None)
    if file is None and before[0] == "explain":
        return []
    try:
        robot = compile_source(
            load(read_text(file or DEFAULT_FILE), file or DEFAULT_FILE), library(), read=read_text
        ).robot
    except RejectedError:
        return []
    return (
        sorted({frame for edge in robot.edges for frame in (edge.parent, edge.child)})
        if robot
        else []
    )


def _codes(_: Sequence[str]) -> list[str]:
    from tfcompose.foundation.catalogue import CATALOGUE

    return list(CATALOGUE)


def _codes_or_frames(before: Sequence[str]) -> list[str]:
    return _frames(before) if any(word.endswith(YAML) for word in before) else _codes(before)


def _section(name: str, before: Sequence[str]) -> list[str]:
    """Return the names in a section of the robot file that is given, or of that of this folder."""
    from tfcompose.spec.load import load

    file = next(
        (word for word in before if word.endswith(YAML) and not is_plan(word)), DEFAULT_FILE
    )
    try:
        section = load(read_text(file), file).data.get(name)
    except RejectedError:
        return []
    return [str(one) for one in section] if isinstance(section, dict) else []


def _profiles(before: Sequence[str]) -> list[str]:
    return _section("profiles", before)


def _hosts(before: Sequence[str]) -> list[str]:
    return _section("hosts", before)


def _given(before: Sequence[str]) -> list[str]:
    return [f"{name}:=" for name in _section("args", before)]


def _presets(_: Sequence[str]) -> list[str]:
    from tfcompose.cli.compiling import library
    from tfcompose.compiler.resolve.presets import node_preset_names

    names = library().names
    return [*names, *dict.fromkeys(name.partition("/")[0] for name in names), *node_preset_names()]


def _robots(_: Sequence[str]) -> list[str]:
    from tfcompose.cli.runs import running
    from tfcompose.launcher.runtime_dir import RuntimeDirError

    try:
        return [place.name for place, _holder in running()]
    except RuntimeDirError:
        return []


def _processes(_: Sequence[str]) -> list[str]:
    """Return the processes of the robots that run in this ROS domain."""
    from tfcompose.cli.runs import in_scope, plan_of_run, running
    from tfcompose.launcher.runtime_dir import RuntimeDirError

    try:
        plans = [plan_of_run(place) for place in in_scope([place for place, _holder in running()])]
    except RuntimeDirError:
        return []
    return [process.name for plan in plans if plan for process in plan.processes]


#: What an argument can be: by its command, or for all commands that have it, and its name.
_SOURCES: dict[tuple[str, str], Callable[[Sequence[str]], list[str]]] = {
    ("", "profiles"): _profiles,
    ("", "robot"): _robots,
    ("", "given"): _given,
    ("up", "host"): _hosts,
    ("", "a"): _frames,
    ("", "b"): _frames,
    ("lint", "select"): _codes,
    ("lint", "ignore"): _codes,
    ("explain", "what"): _codes_or_frames,
    ("presets", "name"): _presets,
    ("logs", "name"): _processes,
    ("start", "name"): _processes,
    ("stop", "name"): _processes,
    ("restart", "name"): _processes,
}
