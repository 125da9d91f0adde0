"""Description of a tool, and the only place where the core finds tools.

A tool adds commands, codes, topics and keys of the robot file to the core. The table in
``tfcompose.tools`` lists the tools that are part of tfcompose. Other packages add tools through
the entry-point group ``tfcompose.tools``. No wing imports a tool. ``shipped_tools`` loads the
table by name, and returns nothing if that folder is missing. ``installed_tools`` adds the tools of
other packages. A tool refers to its functions as ``module:attribute``. They are loaded only when
used, so the table loads fast.
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
    from collections.abc import Callable, Iterator, Mapping

#: The package with the table ``TOOLS`` of tfcompose's own tools. The core knows it only by this
#: name.
SHIPPED = "tfcompose.tools"
#: The entry-point group of tools in other packages. Each entry refers to a ``Tool``.
GROUP = "tfcompose.tools"
#: Pattern of codes of tools in other packages, which have their own prefix, such as ACME101.
_FOREIGN_CODE = re.compile(r"(?!TF\d)[A-Z]{2,8}\d{3}")


class Command(NamedTuple):
    """A command, in a module with ``arguments(parser)`` and ``run(arguments)``.

    The module's docstring is the help of the command.
    """

    name: str
    summary: str
    module: str
    group: str = "Tools"
    #: The topic that ``help`` prints below the options, by default the topic with the command's
    #: name.
    topic: str = ""
    #: Pairs of an argument and a section of the robot file. Shell completion offers the section's
    #: names.
    completes: tuple[tuple[str, str], ...] = ()
    #: Pairs of another program's word for the command, and what to type instead.
    synonyms: tuple[tuple[str, str], ...] = ()


class Topic(NamedTuple):
    """A page for ``help``: ``topics/NAME.md`` in the tool's package."""

    name: str
    about: str
    group: str = "Tools"


class Key(NamedTuple):
    """A section of the robot file with its own model, validated like every other section.

    Its hooks run only for robots whose file has the section.
    """

    name: str
    #: A pydantic model based on ``tfcompose.spec.language.spec.Spec``.
    model: str
    about: str
    examples: tuple[Any, ...] = ()
    #: A function that takes a ``ToolSection`` and returns processes for the robot to start. A
    #: process with the ``argv`` ``(PROGRAM, COMMAND, …)`` runs a command of the tool.
    processes: str = ""
    #: A function that takes a ``ToolSection`` and the ``Robot`` and returns findings. It may read
    #: files.
    check: str = ""
    #: A module with rules, made by ``tfcompose.compiler.check.rule.rule``.
    rules: str = ""
    #: Whether the plan contains the section: ``Plan.sections[name]`` is its model as JSON.
    in_plan: bool = False

    def __hash__(self) -> int:
        """Return a hash of name and model, because examples may be unhashable."""
        return hash((self.name, self.model))


class FileToCheck(NamedTuple):
    """A file that ``lint`` checks by the function of its language."""

    file: str
    #: Returns the text of the file.
    read: Callable[[str], str]
    #: Whether xacro files may run outside of the sandbox.
    trust: bool
    #: Whether no other file may be read, because the file is untrusted.
    is_untrusted: bool


class Language(NamedTuple):
    """A kind of file with its own language, for ``schema`` and ``lint``.

    It has a name, a model, and the title of its reference.
    """

    name: str
    model: str
    title: str
    #: The ends of the names of such files. ``lint`` reads other files as robot files.
    endings: tuple[str, ...] = ()
    #: With ``endings``: a function that takes a ``FileToCheck`` and returns findings.
    check: str = ""


class Option(NamedTuple):
    """Options that a tool adds to commands of the core.

    The module has ``arguments(parser)`` and ``run(name, arguments)``. ``run`` returns an exit
    code, or None to continue with the command itself.
    """

    commands: tuple[str, ...]
    flags: tuple[str, ...]
    module: str


class Tool(NamedTuple):
    """All contributions of a tool."""

    name: str
    #: The package with the folder ``topics``, which has the tool's topics and its commands' pages.
    package: str
    commands: tuple[Command, ...] = ()
    #: The package with the folder ``codes``, which has the pages of its codes; empty without
    #: codes.
    codes: str = ""
    topics: tuple[Topic, ...] = ()
    keys: tuple[Key, ...] = ()
    languages: tuple[Language, ...] = ()
    options: tuple[Option, ...] = ()
    #: The extra of tfcompose that installs its dependencies; empty without dependencies.
    extra: str = ""
    #: A function that takes a machine's share of a ``Plan`` and returns findings before anything
    #: starts, also at a deployment. It runs for plans with a section of the tool, or with a
    #: process that runs a command of the tool.
    preflight: str = ""

    @property
    def topic_folder(self) -> Path:
        """The folder of its topics and its commands' pages."""
        return _folder(self.package) / "topics"

    @property
    def code_folder(self) -> Path | None:
        """The folder of its codes, None without codes."""
        return _folder(self.codes) / "codes" if self.codes else None

    def names(self) -> Iterator[tuple[str, str]]:
        """Yield everything that needs a unique name, as (kind, name)."""
        yield from (("command", command.name) for command in self.commands)
        yield from (("code", code) for code in self.code_names())
        yield from (("topic", topic.name) for topic in self.topics)
        yield from (("key", key.name) for key in self.keys)
        yield from (("language", language.name) for language in self.languages)
        yield from (("option", flag) for option in self.options for flag in option.flags)

    def code_names(self) -> list[str]:
        """Return its codes, from the names of their files."""
        folder = self.code_folder
        return [] if folder is None else sorted(file.stem for file in folder.glob("*.md"))


class Problem(NamedTuple):
    """A fault of a tool in another package: code, message and help of a finding."""

    code: str
    message: str
    help: str


class Toolset(NamedTuple):
    """Tools without conflicts, and problems of tools that were left out."""

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

    def language_of(self, file: str) -> Language | None:
        """Return the language that ``lint`` checks a file by; None for a robot file."""
        languages = self.languages().values()
        return next((each for each in languages if file.endswith(each.endings)), None)

    def options(self, command: str) -> list[Option]:
        """Return the options that tools add to a command of the core."""
        return [
            option for tool in self.tools for option in tool.options if command in option.commands
        ]


def _folder(package: str) -> Path:
    return Path(next(iter(import_module(package).__path__)))


def load(reference: str) -> Any:
    """Return the object that ``module:attribute`` names, or the module without an attribute."""
    module, _, attribute = reference.partition(":")
    loaded = import_module(module)
    return getattr(loaded, attribute) if attribute else loaded


@cache
def shipped_tools() -> Toolset:
    """Return tfcompose's own tools; none if their folder is missing."""
    try:
        table = import_module(SHIPPED)
    except ModuleNotFoundError as error:
        if error.name != SHIPPED:
            raise
        return Toolset(())
    return Toolset(getattr(table, "TOOLS", ()))


@cache
def installed_tools() -> Toolset:
    """Return tfcompose's own tools, then tools of other packages without conflicts."""
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
    """Yield the folders with codes of tfcompose's tools, then of other tools.

    Other tools are looked up only when they are reached.
    """
    for toolset in (shipped_tools, installed_tools):
        yield from filter(None, (tool.code_folder for tool in toolset().tools))


def absent(name: str, *kinds: str) -> str:
    """Return how to install the missing tool that has this name of one of these kinds.

    Empty if no tool has it.
    """
    entries = (_reserved_names().get((kind, name)) for kind in kinds)
    tool, extra = next(filter(None, entries), ("", ""))
    if not extra or any(shipped.name == tool for shipped in shipped_tools().tools):
        return ""
    return f"{name} belongs to the tool {tool}, which is not installed: pip install '{extra}'"


@cache
def _reserved_names() -> dict[tuple[str, str], tuple[str, str]]:
    """Return the owner of each name of the core and its tools, with how to install the owner.

    ``python -m tests.support.names --write`` writes the file, so the names are known even if a
    tool is missing.
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
    """Return the entry points of the group as (name, reference), sorted by name."""
    if not any(map(_may_hold_tools, sys.path)):
        return []
    from importlib.metadata import entry_points

    return sorted({(entry.name, entry.value) for entry in entry_points(group=GROUP)})


def _may_hold_tools(folder: str) -> bool:
    """Return whether a package in a folder of ``sys.path`` may have entry points of the group.

    Most installations have none, and loading ``importlib.metadata`` takes longer than all of
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
        # For some hundred packages, pathlib and decoding would take 20 ms.
        with contextlib.suppress(OSError), open(f"{place}/entry_points.txt", "rb") as file:  # noqa: PTH123
            if section in file.read():
                return True
    return False


_METADATA = (".dist-info", ".egg-info")
