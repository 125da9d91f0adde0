"""Explain a topic, a command or a key of the robot file.

Print the page of a topic, such as language or guard; the options and the page of a command; or
the meaning of a key of the robot file: help sensors, help sensors.place. Without an argument,
list commands and topics.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.cli.terminal import UNREADABLE, fail

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument(
        "word", nargs="?", metavar="TOPIC|COMMAND|KEY", help="a topic, a command or a key"
    )


def run(arguments: Namespace) -> int:
    """Print the page. Return 0, or 2 if the page does not exist."""
    import os
    import pydoc
    import sys

    from tfcompose.cli.documentation import for_terminal, page, topics
    from tfcompose.cli.terminal import is_coloured, table_width
    from tfcompose.cli.tool_commands import instead_of, report_problems
    from tfcompose.foundation.findings import did_you_mean

    commands = arguments.commands()
    report_problems()
    text = page(arguments.word, commands)
    if text is None:
        from tfcompose.foundation.tool import absent
        from tfcompose.spec.language.reference import keys

        pages = [*topics(), *commands, *keys()]
        advice = instead_of(arguments.word) or did_you_mean(
            arguments.word.rpartition(".")[2], pages, f"the topics are {', '.join(topics())}"
        )
        missing = absent(arguments.word.partition(".")[0], "command", "topic", "key", "language")
        fail(missing or f"no topic, command or key {arguments.word}; {advice}", UNREADABLE)
    columns = table_width(sys.stdout)
    os.environ.setdefault("LESS", "FRX")  # less then shows bold text, and ends after one screen
    if columns is not None:
        text = for_terminal(text, columns, coloured=is_coloured(sys.stdout))
    pydoc.pager(text)
    return 0
