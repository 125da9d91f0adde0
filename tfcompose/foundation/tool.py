"""Description of a tool, and the one place where the core finds tools.

A tool adds commands, codes, topics and keys of the robot file to the core. Those that ship stand
in the table of ``tfcompose.tools``; other packages bring theirs by the entry-point group
``tfcompose.tools``. No wing imports a tool: ``shipped`` loads the table by its name, and returns
nothing where that folder is absent; ``installed`` adds the tools of other packages. What a tool
does is named as ``module:attribute`` and loaded when it is used, so the table costs little.
"""

from __future__ import annotations

import contextlib
import os
import re
import sys
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

#: The package with the table of the tools that ship, ``TOOLS``; the only name by which the core
#: knows it.
SHIPPED = "tfcompose.tools"
#: The entry-point group of tools from other packages; each entry leads to a ``Tool``.
GROUP = "tfcompose.tools"
#: Codes of other packages' tools have a prefix of their own: ACME101.
_FOREIGN_CODE = re.compile(r"(?!TF\d)[A-Z]{2,8}\d{3}")


class Command(NamedTuple):
    """A command, in a module with ``arguments(parser)`` and ``run(arguments)``.

    The module's docstring is the help.
    """

    name: str
    summary: str
    module: str
    group: str = "Tools"
    #: The page that ``help`` prints below the options; default: the one with the command's name.
    topic: str = ""
    #: Pairs of an argument and the section of the robot file whose names it takes.
    completes: tuple[tuple[str, str], ...] = ()
    #: Pairs of a word that other programs use for it, and what to type instead.
    synonyms: tuple[tuple[str, str], ...] = ()


class Topic(NamedTuple):
    """A page for ``help``: ``topics/NAME.md`` in the tool's package."""

    name: str
    about: str
    group: str = "Tools"


class Key(NamedTuple):
    """A section of the robot file, with its own model, validated like every other section.

    The hooks run only for robots whose file has the key.
    """

    name: str
    #: A pydantic model based on ``tfcompose.spec.language.spec.Spec``.
    model: str
    about: str
    examples: tuple[Any, ...] = ()
    #: A function of a ``ToolSection`` that returns processes for the robot to start. With the
    #: ``argv`` ``(PROGRAM, COMMAND, …)`` a process runs a command of the tool.
    processes: str = ""
    #: A function of a ``ToolSection`` and the ``Robot`` that returns findings; it may read files.
    check: str = ""
    #: A module with rules, as ``tfcompose.compiler.check.rule.rule`` makes them.
    rules: str = ""
    #: Whether the section is in the plan: ``Plan.sections[name]`` is its model as JSON.
    in_plan: bool = False

    def __hash__(self) -> int:
        """Return the hash of what identifies it: examples may be lists and mappings."""
        return hash((self.name, self.model))


class Language(NamedTuple):
    """A kind of file of its own, for ``schema``.

    Its name, its model, and the heading of its reference.
    """

    name: str
    model: str
    title: str


class Option(NamedTuple):
    """Options that a tool adds to commands of the core.

    The module has ``arguments(parser)`` and ``run(name, arguments)``, which returns an exit code,
    or None for the command itself to go on.
    """

    commands: tuple[str, ...]
    flags: tuple[str, ...]
    module: str


class Tool(NamedTuple):
    """Everything that a tool brings."""

    name: str
    #: The package with the folder ``topics``: the tool's topics and the pages of its commands.
    package: str
    commands: tuple[Command, ...] = ()
    #: The package with the folder ``codes``, the pages of its codes; empty if it has none.
    codes: str = ""
    topics: tuple[Topic, ...] = ()
    keys: tuple[Key, ...] = ()
    languages: tuple[Language, ...] = ()
    options: tuple[Option, ...] = ()
    #: The extra of tfcompose that installs what it needs; empty if it needs nothing.
    extra: str = ""
    #: A function of a ``Plan`` that returns findings before anything starts on a machine, also
    #: when a robot is deployed to it. It runs for plans with a section of the tool or a process
    #: that runs a command of the tool, and gets the share of the machine.
    preflight: str = ""

    @property
    def topic_folder(self) -> Path:
        """The folder of its topics and of the pages of its commands."""
        return _folder(self.package) / "topics"

    @property
    def code_folder(self) -> Path | None:
        """The folder of its codes; None if it has none."""
        return _folder(self.codes) / "codes" if self.codes else None

    def names(self) -> Iterator[tuple[str, str]]:
        """Yield everything it brings under a unique name, as (kind, name)."""
        yield from (("command", command.name) for command in self.commands)
        yield from (("code", code) for code in self.code_names())
        yield from (("topic", topic.name) for topic in self.topics)
        yield from (("key", key.name) for key in self.keys)
        yield from (("language", language.name) for language in self.languages)
        yield from (("option", flag) for option in self.options for flag in option.flags)

    def code_names(self) -> list[str]:
        """Return its codes: the names of their files."""
        folder = self.code_folder
        return [] if folder is None else sorted(file.stem for file in folder.glob("*.md"))


class Problem(NamedTuple):
    """What is wrong with a tool of another package.

    The code of the finding, its message and its help.
    """

    code: str
    message: str
    help: str


class Toolset(NamedTuple):
    """Tools that go together, and what is wrong with those that were left out."""

    tools: tuple[Tool, ...]
    problems: tuple[Problem, ...] = ()

    def commands(self) -> Iterator[tuple[Tool, Command]]:
        """Yield each command with its tool."""
        return ((tool, command) for tool in self.tools for command in tool.commands)

    def topics(self) -> dict[str, tuple[Tool, Topic]]:
        """Return the topics by name."""
        return {topic.name: (tool, topic) for tool in self.tools for topic in tool.topics}

    def keys(self) -> dict[str, Key]:
        """Return the sections of robot files by name."""
        return {key.name: key for tool in self.tools for key in tool.keys}

    def languages(self) -> dict[str, Language]:
        """Return the kinds of files by name."""
        return {language.name: language for tool in self.tools for language in tool.languages}

    def options(self, command: str) -> list[Option]:
        """Return the options that a command of the core gets."""
        return [
            option for tool in self.tools for option in tool.options if command in option.commands
        ]


def _folder(package: str) -> Path:
    return Path(next(iter(import_module(package).__path__)))


def load(reference: str) -> Any:
    """Return what ``module:attribute``, or a module's name alone, leads to."""
    module, _, attribute = reference.partition(":")
    loaded = import_module(module)
    return getattr(loaded, attribute) if attribute else loaded


@cache
def shipped_tools() -> Toolset:
    """Return the tools that ship; none where their folder is absent."""
    try:
        table = import_module(SHIPPED)
    except ModuleNotFoundError as error:
        if error.name != SHIPPED:
            raise
        return Toolset(())
    return Toolset(getattr(table, "TOOLS", ()))


@cache
def installed_tools() -> Toolset:
    """Return the tools that ship, then those of other packages without clashes."""
    entries = _entry_points()
    if not entries:
        return shipped_tools()
    problems: list[Problem] = []
    tools = list(shipped_tools().tools)
    owners = {name: tool.name for tool in tools for name in tool.names()}
    for entry_name, reference in entries:
        try:
            tool = load(reference)
            if not isinstance(tool, Tool):
                raise TypeError(f"{reference} is not a Tool")  # noqa: TRY301 (as if not loaded)
            names = list(tool.names())
        except Exception as error:  # noqa: BLE001 (a foreign package may raise anything)
            message = f"the tool {entry_name} cannot be loaded: {type(error).__name__}: {error}"
            problems.append(
                Problem(
                    "TF921", message, f"update or uninstall the package that provides {reference}"
                )
            )
            continue
        clashes = [*_clashes(tool, owners), *_wrong_codes(tool)]
        problems += clashes
        if not clashes:
            owners |= dict.fromkeys(names, tool.name)
            tools.append(tool)
    return Toolset(tuple(tools), tuple(problems))


def _clashes(tool: Tool, owners: Mapping[tuple[str, str], str]) -> Iterator[Problem]:
    reserved = {name: owner for name, (owner, _) in _reserved_names().items()}
    for kind, name in tool.names():
        owner = reserved.get((kind, name)) or owners.get((kind, name))
        if owner:
            message = f"the tool {tool.name} is left out: {owner} has the {kind} {name}"
            advice = f"uninstall one of them, or rename the {kind}"
            if (kind, name) in reserved:
                advice = f"uninstall it, or rename its {kind}"
            yield Problem("TF922", message, advice)


def _wrong_codes(tool: Tool) -> Iterator[Problem]:
    for code in tool.code_names():
        if not _FOREIGN_CODE.fullmatch(code):
            message = f"the tool {tool.name} is left out: {code} is not a code for a tool"
            advice = "give its codes their own prefix and three digits: ACME101"
            yield Problem("TF922", message, advice)


def code_folders() -> Iterator[Path]:
    """Yield the folders with the codes of the tools that ship, then of the others.

    Those are looked up when reached.
    """
    for toolset in (shipped_tools, installed_tools):
        yield from filter(None, (tool.code_folder for tool in toolset().tools))


def absent(name: str, *kinds: str) -> str:
    """Return what installs the tool that ships and has this name, of one of these kinds.

    Empty if none has.
    """
    entries = (_reserved_names().get((kind, name)) for kind in kinds)
    tool, extra = next(filter(None, entries), ("", ""))
    if not extra or any(other.name == tool for other in shipped_tools().tools):
        return ""
    return f"{name} belongs to the tool {tool}, which is not installed: pip install '{extra}'"


@cache
def _reserved_names() -> dict[tuple[str, str], tuple[str, str]]:
    """Return who owns each name of the core and of the tools that ship, with what installs that.

    The file is written by ``python -m tests.support.names --write``: it also answers where a tool
    is absent.
    """
    from json import loads

    rows = loads(_NAMES.read_text(encoding="utf-8"))
    return {
        (kind, name): (owner, entry["install"])
        for owner, entry in rows.items()
        for kind, names in entry["names"].items()
        for name in names
    }


_NAMES = Path(__file__).parents[1] / "data" / "names.json"


def _entry_points() -> list[tuple[str, str]]:
    """Return the entry points of the group, as (name, reference), by name."""
    if not any(map(_may_hold_tools, sys.path)):
        return []
    from importlib.metadata import entry_points

    return sorted({(entry.name, entry.value) for entry in entry_points(group=GROUP)})


def _may_hold_tools(folder: str) -> bool:
    """Return whether a package in a folder of ``sys.path`` has entry points of the group.

    Most installations have none, and ``importlib.metadata`` takes longer to load than all of
    ``--help``.
    """
    section = f"[{GROUP}]".encode()
    try:
        with os.scandir(folder or ".") as entries:
            places = [entry.path for entry in entries if entry.name.endswith(_METADATA)]
    except NotADirectoryError:
        return folder.endswith((".zip", ".egg"))
    except OSError:
        return False
    for place in places:
        # Of some hundred packages, pathlib and decoding take 20 ms.
        with contextlib.suppress(OSError), open(f"{place}/entry_points.txt", "rb") as file:  # noqa: PTH123
            if section in file.read():
                return True
    return False


_METADATA = (".dist-info", ".egg-info")
