"""``tfcompose tree``: the tree of a robot file, on the terminal."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from tfcompose.cli.compiling import robot_or_code
from tfcompose.emit.tree import tree

if TYPE_CHECKING:
    from argparse import Namespace


def run(arguments: Namespace) -> int:
    """Print the tree; exit code as for build."""
    robot = robot_or_code(arguments.file, arguments.profiles)
    if isinstance(robot, int):
        return robot
    sys.stdout.write(tree(robot))
    return 0
