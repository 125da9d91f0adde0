"""Start a robot, or a built plan, and guard its TF tree.

Build a robot and start it, or start a built plan. On a terminal, show a live view of processes,
edges and findings; ? lists its keys. Elsewhere, or with --no-live, print the output of each
process, live edges with their owners, and when the tree is complete. Ctrl-C, SIGTERM and SIGHUP
stop the robot with exit code 0, or, before anything has started, with that of the signal, such as
130 for Ctrl-C. If a node already publishes an edge, name it and start nothing. If the robot runs
already, restart only the processes that differ.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.cli.start_command import add_start_arguments, build_and_start

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    add_start_arguments(parser)


def run(arguments: Namespace) -> int:
    """Start the plan and return the exit code.

    The code is 0 after a clean end, 1 after a failure or a finding, 2 if something cannot be read.
    """
    return build_and_start(arguments)
