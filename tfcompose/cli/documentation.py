"""Pages of topics and commands.

Markdown in ``topics/``, and what the code knows better than a page.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose import __version__
from tfcompose.cli.command_parser import command_parser
from tfcompose.cli.tool_commands import ToolCommand, add_all_options
from tfcompose.foundation.tool import installed

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from tfcompose.cli.command_parser import CommandModule
    from tfcompose.foundation.catalogue import Family

FOLDER = Path(__file__).parents[1] / "data" / "topics"
#: The topics of the core, in the order of reading, with what their pages are about.
TOPICS = {
    "language": "the robot file, key by key",
    "arguments": "arguments, expressions, conditions, repetition",
    "poses": "positions, rotations, units, optical frames",
    "ownership": "who publishes each edge, and nodes that publish by default",
    "presets": "known sensors and nodes, and your own",
    "calibration": "measured poses from files",
    "processes": "what is started, when it is ready, what follows its end",
    "simulation": "simulated owners and joint states, robots without hardware",
    "bodies": "links, joints, inertia, ros2_control",
    "parts": "other robots as subtrees, namespaces, several robots",
    "merging": "includes, profiles, overlays, and where a value comes from",
    "guard": "what is watched while the robot runs, and what a finding says",
    "strict": "holding back what a process does not own",
    "background": "robots without a terminal: ps, logs, restart, down",
    "rmw": "Fast DDS, Cyclone DDS or Zenoh",
    "sandbox": "what xacro and launch files of other people can do",
    "ci": "lint, diff and verify in CI; exit codes",
    "python": "the TF buffer in Python",
    "costs": "what it costs, measured",
    "codes": "every code that tfcompose finds",
}
#: A link within the documentation.
_LINK = re.compile(r"\[([^\]]+)\]\(#\w+\)")
_COMMENT = re.compile(r"<!--.*?-->\n*", re.DOTALL)


def topics() -> dict[str, str]:
    """Return the topics of the core and of installed tools, with their subjects."""
    of_tools = installed().topics()
    return TOPICS | {name: topic.about for name, (_, topic) in of_tools.items()}


def page(name: str, commands: Mapping[str, CommandModule]) -> str | None:
    """Return the page of a topic, a command's options with its page, or what a key means.

    A topic with the name of a key ends with the key. None if there is none.
    """
    if name in commands:
        options, about = _options(name, commands[name]), _about(name, commands[name])
        return f"{options}\n{about}" if about else options
    from tfcompose.spec.language.reference import key_page

    parts = [topic(name)] if name in topics() else []
    return "\n".join([*parts, *filter(None, [key_page(name)])]) or None


def for_terminal(markdown: str, columns: int, *, coloured: bool = False) -> str:
    """Return the page with tables and paragraphs that fit the columns, as text.

    ``coloured`` sets code in bold, and headings, as control sequences.
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


def topic(name: str) -> str:
    """Return the page of a topic as Markdown, with what the code knows."""
    tool, _ = installed().topics().get(name, (None, None))
    text = _read(name, FOLDER if tool is None else tool.topic_folder)
    more = _GENERATED.get(name)
    return f"{text}\n{more()}" if more else text


def _options(name: str, command: CommandModule) -> str:
    """Return the options of a command, with those that tools add to it."""
    parser = command_parser(name, command)
    add_all_options(name, parser)
    return parser.format_help()


def _about(name: str, command: CommandModule) -> str:
    """Return the page of a command; a tool's is in the tool's folder."""
    if isinstance(command, ToolCommand):
        return _read(command.command.topic or name, command.tool.topic_folder)
    return _read(name, FOLDER)


def _read(name: str, folder: Path) -> str:
    file = folder / f"{name}.md"
    return _COMMENT.sub("", file.read_text("utf-8")) if file.is_file() else ""


def _keys() -> str:
    from tfcompose.spec.language.reference import reference

    return reference("robot").replace("\n# ", "\n## ").replace("# ", "## ", 1)


def code_table(family: Family | None = None) -> str:
    """Return all codes, or those of a family, as a table in Markdown.

    Its columns are code, name, severity, and the first sentence of the page.
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


_GENERATED: dict[str, Callable[[], str]] = {
    "language": _keys,
    "codes": code_table,
    "presets": _vendors,
}

#: The heading of a model in the reference, to which the types of keys lead.
_MODEL = re.compile(r"<h2>(\w+)</h2>")
_CODE_CELL = re.compile(r"<td>([A-Z]+[0-9]{3})</td>")
_STYLE = """
:root { color-scheme: light dark; }
body { margin: 0 auto; max-width: 60rem; padding: 1rem; font: 16px/1.5 system-ui, sans-serif; }
pre { padding: .7rem; overflow-x: auto; background: #8882; border-radius: 4px; }
code { font-size: 90%; }
table { border-collapse: collapse; display: block; overflow-x: auto; }
td, th { padding: .2rem .6rem; border: 1px solid #8886; text-align: left; vertical-align: top; }
nav ul { columns: 7rem; padding-left: 1rem; }
nav h2 { margin-bottom: 0; font-size: 1rem; }
section { border-top: 1px solid #8886; margin-top: 2rem; }
"""


def html(commands: Mapping[str, CommandModule]) -> str:
    """Return all topics and commands as one page that needs no other file.

    Raises:
        ModuleNotFoundError: without the package markdown-it-py.
    """
    from html import escape

    from markdown_it import MarkdownIt

    from tfcompose.foundation.catalogue import CATALOGUE

    renderer = MarkdownIt("commonmark", {"html": False}).enable("table")
    names = topics()
    about = {f"topic-{name}": renderer.render(topic(name)) for name in names}
    about["topic-language"] = _MODEL.sub(_with_id, about["topic-language"])
    about["topic-codes"] = _CODE_CELL.sub(r'<td><a href="#\1">\1</a></td>', about["topic-codes"])
    about["topic-codes"] += "\n".join(
        f'<h2 id="{code}">{code} {entry.name}</h2>\n{renderer.render(CATALOGUE.page(code))}'
        for code, entry in CATALOGUE.items()
    )
    described = {}
    for name, command in commands.items():
        options = escape(_options(name, command))
        text = _about(name, command) if name not in names else ""
        described[f"command-{name}"] = (
            f"<h1>tfcompose {name}</h1>\n<pre>{options}</pre>\n{renderer.render(text)}"
        )
    links = "\n".join(
        _links(title, parts) for title, parts in (("Topics", about), ("Commands", described))
    )
    parts = about | described
    sections = "\n".join(
        f'<section id="{part}">\n{text}</section>' for part, text in parts.items()
    )
    return (
        '<!doctype html>\n<html lang="en">\n<meta charset="utf-8">\n<meta name="viewport"'
        ' content="width=device-width">\n<title>tfcompose'
        f" {__version__}</title>\n<style>{_STYLE}</style>\n<h1>tfcompose"
        f" {__version__}</h1>\n<nav>\n{links}\n</nav>\n{sections}\n</html>\n"
    )


def _links(title: str, parts: Mapping[str, str]) -> str:
    items = "".join(f'<li><a href="#{part}">{part.partition("-")[2]}</a></li>' for part in parts)
    return f"<h2>{title}</h2>\n<ul>{items}</ul>"


def _with_id(heading: re.Match[str]) -> str:
    return f'<h2 id="{heading[1].lower()}">{heading[1]}</h2>'
