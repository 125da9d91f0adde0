"""``tfcompose tree``: the tree of a robot file, on the terminal, or the one that is published.

Print the tree: each frame with the kind, owner, rate and pose of its edge. With --live or --bag it is the published
one: each frame with the kind, the publishing node, rate and age of the newest stamp; with FILE the owner, and what is
expected, unexpected or missing. Trees that do not hang together are shown one after the other.
"""

from __future__ import annotations

import sys
from importlib import import_module
from typing import TYPE_CHECKING

from tfcompose.cli.compiling import robot_or_code
from tfcompose.cli.options import DEFAULT_FILE, add_variant, namespace, positive
from tfcompose.render.tree import tree

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument("file", nargs="?", metavar="FILE", help="default: robot.yaml; with --live or --bag: none")
    add_variant(parser)
    parser.add_argument("--live", action="store_true", help="the tree that is published now")
    parser.add_argument("--bag", metavar="BAG", help="the tree of a recording: a rosbag2 folder, .mcap or .db3")
    parser.add_argument(
        "--for", dest="duration", type=positive, default=3.0, metavar="S", help="look so long; default: 3"
    )
    parser.add_argument(
        "--namespace", type=namespace, default="", metavar="NS", help="/NS/tf and /NS/tf_static instead, without FILE"
    )
    parser.add_argument("--format", choices=("text", "json"), default="text", help="default: text")


def run(arguments: Namespace) -> int:
    """Print the tree; exit code as for build."""
    if arguments.live or arguments.bag:
        code: int = import_module("tfcompose.cli.live_tree").live_tree(arguments)
        return code
    robot = robot_or_code(arguments.file or DEFAULT_FILE, arguments)
    if isinstance(robot, int):
        return robot
    final = robot.with_final_names()
    if arguments.format == "json":
        sys.stdout.write(import_module("tfcompose.cli.tree_json").planned_json(final))
        return 0
    sys.stdout.write(tree(final))
    return 0
