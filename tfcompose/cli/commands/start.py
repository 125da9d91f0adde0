"""Start processes that were stopped or have ended.

Start processes of a running robot that were stopped, have ended, or wait for their restart.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.cli.options import add_processes

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    add_processes(parser)


def run(arguments: Namespace) -> int:
    """Ask the launcher; exit code 0, 1 where it refuses or none runs, 2 where several robots run and none is named."""
    from tfcompose.cli.runs import control_processes

    return control_processes(arguments, "start", "starting")
