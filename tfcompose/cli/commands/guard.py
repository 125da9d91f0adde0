"""Guard the TF tree of a robot that other launch files start.

Start the guard of a robot file and nothing else: every process, also the publishers of fixed edges
and joints, is external. The guard reports missing, silent and slow edges, and nodes that publish
an edge they do not own, as in up. `adopt` writes such a robot file from what runs.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.cli.start_command import add_start_arguments, build_and_start

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    add_start_arguments(parser, guard_alone=True)


def run(arguments: Namespace) -> int:
    """Start the guard and return the exit code, as ``up`` does."""
    return build_and_start(arguments)
