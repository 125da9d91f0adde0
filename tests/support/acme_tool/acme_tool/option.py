"""Option ``--beeper`` of ``tree``: print where the beeper is instead."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace


def arguments(parser: ArgumentParser) -> None:
    """Add the option."""
    parser.add_argument("--beeper", action="store_true", help="print where the beeper is")


def run(command: str, arguments: Namespace) -> int | None:
    """Print the frame; None without the option."""
    if not arguments.beeper:
        return None
    from tfcompose.cli.compiling import compile_or_exit
    from tfcompose.cli.options import DEFAULT_FILE

    robot = compile_or_exit(arguments.file or DEFAULT_FILE, arguments)
    print(f"{command}: {robot.sections['acme'].value.frame}")
    return 0
