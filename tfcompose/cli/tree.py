"""``tfcompose tree``: the tree of a robot file, on the terminal.

Print the tree: each frame with the kind, owner, rate and pose of its edge.
"""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from tfcompose.cli.compiling import robot_or_code
from tfcompose.cli.options import add_file, add_variant
from tfcompose.emit.final import with_final_names
from tfcompose.emit.tree import tree

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    add_file(parser)
    add_variant(parser)


def run(arguments: Namespace) -> int:
    """Print the tree; exit code as for build."""
    robot = robot_or_code(arguments.file, arguments)
    if isinstance(robot, int):
        return robot
    sys.stdout.write(tree(with_final_names(robot)))
    return 0
