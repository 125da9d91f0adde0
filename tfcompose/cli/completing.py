"""What a word of a command line can be: commands, options, their values, and names that the robot file has.

Where nothing is returned the shell offers files.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.cli.command_parser import Command, command_parser
from tfcompose.cli.documentation import TOPICS
from tfcompose.cli.options import DEFAULT_FILE
from tfcompose.cli.plans import is_plan
from tfcompose.cli.reading import read_text
from tfcompose.findings import RejectedError

if TYPE_CHECKING:
    from argparse import Action
    from collections.abc import Callable, Iterable, Mapping, Sequence

YAML = (".yaml", ".yml")


def candidates(commands: Mapping[str, Command], words: Sequence[str], at: int) -> list[str]:
    """Return what ``words[at]`` can be; ``words`` begins with the program's name, and the word may be half written."""
    if at < 1:
        return []
    word, before = (words[at] if at < len(words) else ""), list(words[1:at])
    if not before:
        return _beginning(word, [*commands, "--help", "--version"])
    if before[0] not in commands:
        return []
    if before == ["help"]:
        from tfcompose.language.reference import keys, paths

        return _beginning(word, [*TOPICS, *commands, *(paths() if "." in word else keys())])
    actions = command_parser(before[0], commands[before[0]])._actions  # noqa: SLF001 (argparse has no other way)
    options = {text: action for action in actions for text in action.option_strings}
    valued = options.get(before[-1])
    if valued is not None and valued.nargs != 0:
        return _beginning(word, _values(valued, before))
    if word.startswith("-"):
        return _beginning(word, options)
    positionals = [one for one in actions if not one.option_strings]
    return _beginning(word, [value for one in positionals for value in _values(one, before)])


def _beginning(word: str, known: Iterable[str]) -> list[str]:
    return [one for one in dict.fromkeys(known) if one.startswith(word)]


def _values(action: Action, before: Sequence[str]) -> list[str]:
    """Return the values of an argument, as far as they have names."""
    if action.choices is not None:
        return [str(one) for one in action.choices]
    source = _SOURCES.get((before[0], action.dest)) or _SOURCES.get(("", action.dest))
    return source(before) if source else []


def _frames(before: Sequence[str]) -> list[str]:
    """Return the frames of the robot file; before it is named, nothing: files are meant."""
    from tfcompose.cli.compiling import library
    from tfcompose.compile import compile_source
    from tfcompose.load import load

    file = next((word for word in before if word.endswith(YAML)), None)
    if file is None and before[0] == "explain":
        return []
    try:
        robot = compile_source(
            load(read_text(file or DEFAULT_FILE), file or DEFAULT_FILE), library(), read=read_text
        ).robot
    except RejectedError:
        return []
    return sorted({frame for edge in robot.edges for frame in (edge.parent, edge.child)}) if robot else []


def _codes(_: Sequence[str]) -> list[str]:
    from tfcompose.catalogue import CATALOGUE

    return list(CATALOGUE)


def _codes_or_frames(before: Sequence[str]) -> list[str]:
    return _frames(before) if any(word.endswith(YAML) for word in before) else _codes(before)


def _profiles(before: Sequence[str]) -> list[str]:
    """Return the profiles of the robot file that is named, or of that of this folder."""
    from tfcompose.load import load

    file = next((word for word in before if word.endswith(YAML) and not is_plan(word)), DEFAULT_FILE)
    try:
        profiles = load(read_text(file), file).data.get("profiles")
    except RejectedError:
        return []
    return [str(one) for one in profiles] if isinstance(profiles, dict) else []


def _presets(_: Sequence[str]) -> list[str]:
    from tfcompose.cli.compiling import library
    from tfcompose.resolve.presets import node_preset_names

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
