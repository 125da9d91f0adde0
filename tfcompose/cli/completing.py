"""Completion of a command line: commands, options, values, and names in the robot file.

argcomplete parses the line and answers the shell. This module supplies the names for each
argument.
"""

from __future__ import annotations

import os
import re
import sys
from argparse import ArgumentParser
from functools import partial
from typing import TYPE_CHECKING

import argcomplete
from argcomplete.completers import FilesCompleter, SuppressCompleter
from argcomplete.lexers import split_line

from tfcompose.cli.command_parser import CommandModule, Parser
from tfcompose.cli.documentation import topics
from tfcompose.cli.options import DEFAULT_FILE
from tfcompose.cli.plans import is_plan
from tfcompose.cli.reading import read_text
from tfcompose.cli.tool_commands import add_all_options, find
from tfcompose.foundation.findings import RejectedError

if TYPE_CHECKING:
    from argparse import Action
    from collections.abc import Callable, Iterable, Mapping, Sequence

    Source = Callable[[Sequence[str]], list[str]]

YAML = (".yaml", ".yml")


#: Words in the help of arguments that take a file or a folder.
PATHS = frozenset({"FILE", "DIR", "FOLDER", "BAG", "PICTURE", "PLAN", "OLD", "NEW"})


def complete(commands: Mapping[str, CommandModule]) -> None:
    """Print completions of the argument at the shell's cursor, and exit.

    Raises:
        SystemExit: always, with code 0.
    """
    line, point = os.environ["COMP_LINE"], int(os.environ["COMP_POINT"])
    _quote, _prefix, _suffix, typed, _break = split_line(line, point)
    argv = list(map(_expand_tilde, typed[1:]))
    if argv and argv[0] not in commands:
        commands = {}
    parser = ArgumentParser(prog="tfcompose")
    parser.add_argument("--version", action="version")
    subparsers = parser.add_subparsers(parser_class=Parser)
    for name, command in commands.items():
        subparser = subparsers.add_parser(name)
        if [name] == argv[:1]:
            command.arguments(subparser)
            add_all_options(name, subparser)
            for action in subparser._actions:  # noqa: SLF001 (argparse has no other way)
                if action.choices is None:
                    action.completer = _Completer(action, argv, commands)  # type: ignore[attr-defined]
    argcomplete.autocomplete(
        parser,
        always_complete_options=False,
        default_completer=SuppressCompleter(),
        exit_method=sys.exit,
    )


def _expand_tilde(argument: str) -> str:
    return os.path.expanduser(argument)  # noqa: PTH111 (an unknown user's stays as it is)


class _Completer:
    """Completes an argument of a command line with names and files."""

    def __init__(self, action: Action, argv: Sequence[str], commands: Iterable[str]) -> None:
        self._source = _source_of(action, argv[0], commands)
        self._argv = argv
        self._is_path = isinstance(action.metavar, str) and not PATHS.isdisjoint(
            re.findall("[A-Z]+", action.metavar)
        )
        self._is_list = action.metavar == "CODES"

    def __call__(self, prefix: str, **_: object) -> list[str]:
        """Return completions of the argument, or of the last part of a list with commas."""
        first, comma, _last = prefix.rpartition(",") if self._is_list else ("", "", prefix)
        names = [f"{first}{comma}{name}" for name in self._source(self._argv)]
        return [*names, *FilesCompleter()(prefix)] if self._is_path else names


def _source_of(action: Action, command: str, commands: Iterable[str]) -> Source:
    """Return the function that lists the possible names for an argument of the command."""
    if command == "help":
        return partial(_help_pages, commands)
    source = _SOURCES.get((command, action.dest)) or _SOURCES.get(("", action.dest))
    if source:
        return source
    tool_command = find(command)
    section = dict(tool_command.command.completes).get(action.dest) if tool_command else None
    return partial(_section, section) if section else _nothing


def _frames(argv: Sequence[str]) -> list[str]:
    """Return the frames of the robot file on the line, or of ``robot.yaml`` here.

    For ``explain`` without a file return nothing, because the next argument may be a file.
    """
    from tfcompose.cli.compiling import library
    from tfcompose.compiler.compile import compile_source
    from tfcompose.spec.load import load

    file = next((argument for argument in argv if argument.endswith(YAML)), None)
    if file is None and argv[0] == "explain":
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


def _nothing(_: Sequence[str]) -> list[str]:
    return []


def _help_pages(commands: Iterable[str], _: Sequence[str]) -> list[str]:
    from tfcompose.spec.language.reference import keys, paths

    return [*topics(), *commands, *keys(), *paths()]


def _codes(_: Sequence[str]) -> list[str]:
    from tfcompose.foundation.catalogue import CATALOGUE

    return list(CATALOGUE)


def _codes_or_frames(argv: Sequence[str]) -> list[str]:
    return _frames(argv) if any(argument.endswith(YAML) for argument in argv) else _codes(argv)


def _section(name: str, argv: Sequence[str]) -> list[str]:
    """Return the names in a section of the robot file on the line, or of ``robot.yaml`` here."""
    from tfcompose.spec.load import load

    file = next(
        (argument for argument in argv if argument.endswith(YAML) and not is_plan(argument)),
        DEFAULT_FILE,
    )
    try:
        section = load(read_text(file), file).data.get(name)
    except RejectedError:
        return []
    return [str(name) for name in section] if isinstance(section, dict) else []


def _profiles(argv: Sequence[str]) -> list[str]:
    return _section("profiles", argv)


def _hosts(argv: Sequence[str]) -> list[str]:
    return _section("hosts", argv)


def _settings_in(argv: Sequence[str]) -> list[str]:
    return [f"{name}:=" for name in _section("args", argv)]


def _presets(_: Sequence[str]) -> list[str]:
    from tfcompose.cli.compiling import library
    from tfcompose.compiler.resolve.presets import node_preset_names

    names = library().names
    return [*names, *dict.fromkeys(name.partition("/")[0] for name in names), *node_preset_names()]


def _robots(_: Sequence[str]) -> list[str]:
    from tfcompose.cli.runs import running
    from tfcompose.launcher.runtime_dir import RuntimeDirError

    try:
        return [runtime_dir.name for runtime_dir, _holder in running()]
    except RuntimeDirError:
        return []


def _processes(_: Sequence[str]) -> list[str]:
    """Return the names of all processes of robots in this ROS domain."""
    from tfcompose.cli.runs import in_scope, plan_of_run, running
    from tfcompose.launcher.runtime_dir import RuntimeDirError

    try:
        plans = [plan_of_run(place) for place in in_scope([place for place, _holder in running()])]
    except RuntimeDirError:
        return []
    return [process.name for plan in plans if plan for process in plan.processes]


#: The possible values of an argument, by (command, argument). An empty command means all commands
#: with that argument.
_SOURCES: dict[tuple[str, str], Source] = {
    ("", "profiles"): _profiles,
    ("", "robot"): _robots,
    ("", "arg_values"): _settings_in,
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
