"""The pages of topics and commands, which are Markdown in ``topics/``, and what the code knows better than a page."""

from __future__ import annotations

import re
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose import __version__
from tfcompose.cli.command_parser import command_parser

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from tfcompose.cli.command_parser import Command

FOLDER = Path(__file__).parents[1] / "topics"
#: What a page is about, in the order of reading.
TOPICS = {
    "language": "the robot file, key by key",
    "poses": "positions, rotations, units, optical frames",
    "presets": "known sensors and nodes, and your own",
    "calibration": "measured poses from files",
    "processes": "what is started, when it is ready, what follows its end",
    "guard": "what is watched while the robot runs, and what a finding says",
    "strict": "holding back what a process does not own",
    "background": "robots without a terminal: ps, logs, restart, down",
    "hosts": "a robot on several computers",
    "exports": "systemd, docker compose and launch files",
    "ci": "lint, diff and verify in CI; exit codes",
    "python": "the TF buffer in Python",
    "costs": "what it costs, measured",
    "codes": "every code that tfcompose finds",
}
_COMMENT = re.compile(r"<!--.*?-->\n*", re.DOTALL)
#: Commands with a page under another name.
_PAGES = {"export": "exports"}


def page(word: str, commands: Mapping[str, Command]) -> str | None:
    """Return the page of a topic, or a command's options with its page; None if there is neither."""
    if word in commands:
        options = command_parser(word, commands[word]).format_help()
        about = _read(_PAGES.get(word, word))
        return f"{options}\n{about}" if about else options
    return topic(word) if word in TOPICS else None


def topic(word: str) -> str:
    """Return the page of a topic as Markdown, with what the code knows."""
    text = _read(word)
    more = _GENERATED.get(word)
    return f"{text}\n{more()}" if more else text


def _read(word: str) -> str:
    file = FOLDER / f"{word}.md"
    return _COMMENT.sub("", file.read_text("utf-8")) if file.is_file() else ""


def _keys() -> str:
    from tfcompose.language.reference import reference

    return reference("robot").replace("\n# ", "\n## ").replace("# ", "## ", 1)


def _codes() -> str:
    from tfcompose.pages import table

    return table(None)


def _vendors() -> str:
    from tfcompose.cli.compiling import library

    models: dict[str, list[str]] = {}
    for name in library().names:
        vendor, _, model = name.partition("/")
        models.setdefault(vendor, []).append(model)
    rows = "".join(f"| {vendor} | {', '.join(names)} |\n" for vendor, names in models.items())
    return f"| vendor | models |\n|---|---|\n{rows}"


_GENERATED: dict[str, Callable[[], str]] = {"language": _keys, "codes": _codes, "presets": _vendors}

_STYLE = """
:root { color-scheme: light dark; }
body { margin: 0 auto; max-width: 60rem; padding: 1rem; font: 16px/1.5 system-ui, sans-serif; }
pre { padding: .7rem; overflow-x: auto; background: #8882; border-radius: 4px; }
code { font-size: 90%; }
table { border-collapse: collapse; display: block; overflow-x: auto; }
td, th { padding: .2rem .6rem; border: 1px solid #8886; text-align: left; vertical-align: top; }
nav ul { columns: 3; padding-left: 1rem; }
section { border-top: 1px solid #8886; margin-top: 2rem; }
"""


def html(commands: Mapping[str, Command]) -> str:
    """Return all topics and commands as one page that needs no other file.

    Raises:
        ModuleNotFoundError: without the package markdown-it-py.
    """
    from markdown_it import MarkdownIt

    renderer = MarkdownIt("commonmark", {"html": False}).enable("table")
    parts = {f"topic-{word}": renderer.render(topic(word)) for word in TOPICS}
    for name, command in commands.items():
        options = escape(command_parser(name, command).format_help())
        about = renderer.render(_read(name)) if name not in TOPICS else ""
        parts[f"command-{name}"] = f"<h1>tfcompose {name}</h1>\n<pre>{options}</pre>\n{about}"
    names = "".join(f'<li><a href="#{part}">{part.partition("-")[2]}</a></li>' for part in parts)
    sections = "\n".join(f'<section id="{part}">\n{text}</section>' for part, text in parts.items())
    return (
        f'<!doctype html>\n<html lang="en">\n<meta charset="utf-8">\n'
        f'<meta name="viewport" content="width=device-width">\n<title>tfcompose {__version__}</title>\n'
        f"<style>{_STYLE}</style>\n<h1>tfcompose {__version__}</h1>\n<nav><ul>{names}</ul></nav>\n{sections}\n</html>\n"
    )
