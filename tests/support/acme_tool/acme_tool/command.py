"""List the frames that hear a robot's beeper.

Print one frame per line: those that the section acme of FILE names.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.cli.options import add_file, add_variant

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    add_file(parser)
    add_variant(parser)


def run(arguments: Namespace) -> int:
    """Print the frames; exit code 0."""
    from tfcompose.cli.compiling import compile_or_exit

    section = compile_or_exit(arguments.file, arguments).sections["acme"]
    print(section.value.frame)
    return 0
