"""Draw the tree as SVG, PNG, DOT or Mermaid.

Draw the tree: frames coloured by owner, fixed and moving edges, each sensor in a box. The suffix
of the file selects the format: .svg, .png, .dot (Graphviz) or .mmd (Mermaid). With --live or
--bag, draw the published tree, coloured by publisher, including second parents and loops. With
FILE, also draw missing frames.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.cli.options import (
    DEFAULT_FILE,
    add_bag,
    add_for,
    add_namespace,
    add_variant,
    settle_duration,
)
from tfcompose.cli.terminal import UNREADABLE, fail

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace

    from tfcompose.compiler.draw import Graph

FORMATS = (".svg", ".png", ".dot", ".gv", ".mmd")
FORMAT_NAMES = "svg, png, dot or mmd"


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument(
        "file", nargs="?", metavar="FILE", help="default: robot.yaml, or none with --live or --bag"
    )
    add_variant(parser)
    parser.add_argument(
        "-o",
        "--output",
        default="tree.svg",
        metavar="PICTURE",
        help=f"a file ending in {FORMAT_NAMES}; default: tree.svg",
    )
    parser.add_argument(
        "--live",
        action="store_true",
        help="draw the tree that is published now; with FILE, also missing frames",
    )
    add_bag(parser, "draw the tree of a recording")
    add_for(parser, "with --live: observe for S seconds; default: 3")
    add_namespace(parser, "use /NS/tf and /NS/tf_static, without FILE")
    parser.add_argument(
        "--poses",
        action="store_true",
        help="show each frame's pose in its parent, in metres and degrees",
    )
    parser.add_argument(
        "--direction",
        choices=("auto", "right", "down", "columns"),
        default="auto",
        help=(
            "direction from parent to child; default: auto: right, unless the page would be "
            "too wide or too tall"
        ),
    )
    parser.add_argument(
        "--collapse",
        action="store_true",
        help="for each sensor, draw only its mount and the frames between it and other frames",
    )


def run(arguments: Namespace) -> int:
    """Draw the graph.

    Exit code 0, 1 with errors in the robot, 2 for an unknown ending or a file that cannot be read
    or written.
    """
    path = Path(arguments.output)
    _check_output(path)
    settle_duration(arguments, 3.0, is_live=arguments.live)
    if arguments.live or arguments.bag:
        graph = _published_graph(arguments)
    else:
        from tfcompose.cli.compiling import compile_or_exit
        from tfcompose.compiler.render.tree import graph_of

        robot = compile_or_exit(arguments.file or DEFAULT_FILE, arguments)
        graph = graph_of(robot.with_final_names(), poses=arguments.poses)
    from tfcompose.cli.tree_picture import picture
    from tfcompose.cli.writing import replace_file

    if arguments.collapse:
        from tfcompose.compiler.draw.graph import collapse_groups

        graph = collapse_groups(graph)
    try:
        replace_file(path, picture(graph, path.suffix.lower(), arguments.direction))
    except OSError as error:
        fail(f"{path} was not written: {error.strerror}", UNREADABLE)
    print(f"wrote {path}")
    return 0


def _check_output(path: Path) -> None:
    """Refuse a picture that cannot be written before doing any work for it.

    Raises:
        SystemExit: after reporting the reason.
    """
    ending = path.suffix.lower()
    if ending == ".pdf":
        svg_path = path.with_suffix(".svg")
        fail(f"graph writes no PDF: write {svg_path}, and print it in a browser", UNREADABLE)
    if ending not in FORMATS:
        what = (
            f"{path.suffix} is not a format that graph writes"
            if ending
            else f"{path} has no suffix"
        )
        fail(f"{what}; -o takes a file ending in {FORMAT_NAMES}", UNREADABLE)
    from tfcompose.foundation.reading import is_folder

    if not is_folder(path.parent):
        fail(f"{path} cannot be written: no folder {path.parent}", UNREADABLE)
    if ending == ".png":
        from tfcompose.cli.writing import require_png_packages

        require_png_packages()


def _published_graph(arguments: Namespace) -> Graph:
    """Return the published tree as a graph."""
    from tfcompose.cli.live import observe_for
    from tfcompose.cli.tree_picture import graph_of_observers

    plan, observers = observe_for("tfcompose_graph", arguments)
    title = arguments.bag or (plan.robot if plan else next(iter(observers))[0])
    return graph_of_observers(list(observers.values()), title, plan, poses=arguments.poses)
