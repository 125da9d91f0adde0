"""``tfcompose start``: start one process that was stopped, or has ended.

Start one process of a running robot that was stopped, has ended, or waits for its restart.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.cli.running import add_robot, ask_of_each

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument("name", nargs="+", metavar="NAME", help="the process; tfcompose ps lists them")
    add_robot(parser)


def run(arguments: Namespace) -> int:
    """Ask the launcher; exit code 0, 1 where it refuses or none runs, 2 where several robots run and none is named."""
    return ask_of_each(arguments, "start", "starting")
