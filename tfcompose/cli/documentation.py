"""Pages of topics and commands: Markdown in ``topics/``, and parts that the code generates."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.cli.command_parser import command_parser
from tfcompose.cli.tool_commands import ToolCommand, add_all_options
from tfcompose.foundation.tool import installed_tools

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from tfcompose.cli.command_parser import CommandModule
    from tfcompose.foundation.catalogue import Family

FOLDER = Path(__file__).parents[1] / "data" / "topics"
#: The core's topics in groups, in reading order, with the subject of each page.
TOPIC_GROUPS = {
    "Robot file": {
        "language": "the robot file, key by key",
        "arguments": "arguments, expressions, conditions, repetition",
        "poses": "positions, rotations, units, optical frames",
        "ownership": "who publishes each edge, and nodes that publish by default",
        "presets": "known sensors and nodes, and your own",
        "calibration": "measured poses from files",
        "processes": "what to start, when it is ready, and what happens when it exits",
        "simulation": "simulated owners and joint states, robots without hardware",
        "bodies": "links, joints, inertia, ros2_control",
        "parts": "other robots as subtrees, namespaces, several robots",
        "merging": "includes, profiles, overlays, and where a value comes from",
    },
    "Running robots": {
        "guard": "what the guard checks while the robot runs, and how to read its findings",
        "strict": "blocking edges that a process does not own",
        "background": "robots without a terminal: ps, logs, restart, down",
        "rmw": "Fast DDS, Cyclone DDS or Zenoh",
        "sandbox": "what xacro and launch files from others can and cannot do",
    },
    "Reference": {
        "ci": "lint, diff and verify in CI; exit codes",
        "python": "the TF buffer in Python",
        "costs": "memory, CPU and latency, measured",
        "codes": "all codes of findings",
    },
}
TOPICS = {name: about for group in TOPIC_GROUPS.values() for name, about in group.items()}
#: A link within the documentation.
_LINK = re.compile(r"\[([^\]]+)\]\(#\w+\)")
_COMMENT = re.compile(r"^<!--.*?-->\n*", re.DOTALL | re.MULTILINE)


def topics() -> dict[str, str]:
    """Return the topics of the core and of installed tools, each with its subject."""
    of_tools = installed_tools().topics()
    return TOPICS | {name: topic.about for name, (_, topic) in of_tools.items()}


def topic_groups() -> dict[str, dict[str, str]]:
    """Return the topics of the core and of installed tools by group."""
    groups = {title: dict(names) for title, names in TOPIC_GROUPS.items()}
    reference = groups.popitem()
    for name, (_, topic) in installed_tools().topics().items():
        groups.setdefault(topic.group, {})[name] = topic.about
    return groups | dict([reference])


def page(name: str, commands: Mapping[str, CommandModule]) -> str | None:
    """Return the page of a topic or a command, or the meaning of a key.

    The page of a command includes its options. If a topic and a key have the same name, the
    topic's page ends with the key. Return None for an unknown name.
    """
    if name in commands:
        options, about = _options(name, commands[name]), text_of_command(name, commands[name])
        return f"{options}\n{about}" if about else options
    from tfcompose.spec.language.reference import key_page

    parts = [topic(name)] if name in topics() else []
    return "\n".join([*parts, *filter(None, [key_page(name)])]) or None


def for_terminal(markdown: str, columns: int, *, coloured: bool = False) -> str:
    """Return the page as text, with tables and paragraphs that fit the columns.

    With ``coloured``, control sequences set code in bold and mark headings.
    """
    from io import StringIO

    from rich.console import Console
    from rich.markdown import Markdown
    from rich.theme import Theme

    options, begin, page = (
        markdown.partition("\n# ") if markdown.startswith("usage: ") else ("", "", markdown)
    )
    stream = StringIO()
    text = _LINK.sub(r"\1", f"# {page}" if begin else page)
    console = Console(
        file=stream,
        width=columns,
        force_terminal=coloured,
        no_color=True,
        theme=Theme({"markdown.code": "bold"}),
    )
    console.print(Markdown(text, code_theme="bw", hyperlinks=False))
    lines = [line.rstrip() for line in stream.getvalue().splitlines()]
    fitted = re.sub(r"\n{3,}", "\n\n", "\n".join(lines))
    return f"{options}{begin[:1]}{fitted}\n"


def topic(name: str, *, with_reference: bool = True) -> str:
    """Return the page of a topic as Markdown, with its generated parts.

    Without the reference, the page omits the lists of all keys and all codes.
    """
    tool, _ = installed_tools().topics().get(name, (None, None))
    text = _read(name, FOLDER if tool is None else tool.topic_folder)
    more = _GENERATED.get(name) or (with_reference and _REFERENCES.get(name))
    return f"{text}\n{more()}" if more else text


def _options(name: str, command: CommandModule) -> str:
    """Return the help on the options of a command, including the options of tools."""
    parser = command_parser(name, command)
    add_all_options(name, parser)
    return parser.format_help()


def text_of_command(name: str, command: CommandModule) -> str:
    """Return a command's page as Markdown, empty without one.

    A tool's pages are in its own folder.
    """
    folder = command.tool.topic_folder if isinstance(command, ToolCommand) else FOLDER
    return _read(topic_of_command(name, command), folder)


def topic_of_command(name: str, command: CommandModule) -> str:
    """Return the name of a command's page: a topic, or the command's own name."""
    return (isinstance(command, ToolCommand) and command.command.topic) or name


def _read(name: str, folder: Path) -> str:
    file = folder / f"{name}.md"
    return _COMMENT.sub("", file.read_text("utf-8")) if file.is_file() else ""


def _keys() -> str:
    from tfcompose.spec.language.reference import reference

    return reference("robot").replace("\n# ", "\n## ").replace("# ", "## ", 1)


def code_table(family: Family | None = None) -> str:
    """Return all codes, or the codes of a family, as a Markdown table.

    The columns are code, name, severity, and the first sentence of the code's page.
    """
    from tfcompose.foundation.catalogue import CATALOGUE

    rows = [
        f"| {code.code} | {code.name} | {code.severity} | {CATALOGUE.summary(code.code)} |\n"
        for code in CATALOGUE.values()
        if family in {None, code.family}
    ]
    return "".join(["| code | name | severity | what is wrong |\n", "|---|---|---|---|\n", *rows])


def _vendors() -> str:
    from tfcompose.cli.compiling import library

    models: dict[str, list[str]] = {}
    for name in library().names:
        vendor, _, model = name.partition("/")
        models.setdefault(vendor, []).append(model)
    rows = "".join(f"| {vendor} | {', '.join(names)} |\n" for vendor, names in models.items())
    return f"| vendor | models |\n|---|---|\n{rows}"


#: Functions that generate the text after a topic's page.
_GENERATED: dict[str, Callable[[], str]] = {"presets": _vendors}
_REFERENCES: dict[str, Callable[[], str]] = {"language": _keys, "codes": code_table}
