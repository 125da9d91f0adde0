"""Draw the tree as SVG, PNG, DOT or Mermaid.

Draw the tree: frames coloured by owner, fixed and moving edges, each sensor in a box. The suffix
of the file selects the format: .svg, .png, .dot (Graphviz) or .mmd (Mermaid). With --live or
--bag, draw the published tree, coloured by publisher, including second parents and loops. With
FILE, also draw missing frames.
"""

from __future__ import annotations

from importlib.util import find_spec
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
from tfcompose.cli.terminal import UNREADABLE, fail, printable
from tfcompose.foundation.geometry import Pose, norm, normalise

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace
    from collections.abc import Sequence

    from tfcompose.compiler.draw import Arrow, Graph
    from tfcompose.compiler.draw.arrange import Direction
    from tfcompose.compiler.draw.graph import Kind
    from tfcompose.model.plan import Plan
    from tfcompose.tf.live.edges import EdgeState, TreeObserver

FORMATS = (".svg", ".png", ".dot", ".gv", ".mmd")
FORMAT_NAMES = "svg, png, dot or mmd"
PNG_PACKAGES = ("resvg_py", "font_lato")


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
    missing = [package for package in PNG_PACKAGES if find_spec(package) is None]
    if ending == ".png" and missing:
        advice = "pip install 'tfcompose[pictures]'; svg needs nothing"
        fail(f"PNG needs the package {missing[0]}: {advice}", UNREADABLE)


def picture(graph: Graph, ending: str, direction: Direction = "auto") -> bytes:
    """Return the graph as a file of this format; import only the modules for it."""
    if ending == ".mmd":
        from tfcompose.compiler.draw.mermaid import mermaid

        return mermaid(graph, is_down=direction == "down").encode()
    if ending in {".dot", ".gv"}:
        from tfcompose.compiler.draw.dot import dot

        return dot(graph, is_down=direction == "down").encode()
    from tfcompose.compiler.draw.picture import draw

    drawing = draw(graph, direction)
    if ending == ".png":
        from tfcompose.compiler.draw.png import png

        return png(drawing)
    from tfcompose.compiler.draw.svg import svg

    return svg(drawing).encode()


def _published_graph(arguments: Namespace) -> Graph:
    """Return the published tree as a graph."""
    from tfcompose.cli.live import observe_for

    plan, observers = observe_for("tfcompose_graph", arguments)
    title = arguments.bag or (plan.robot if plan else next(iter(observers))[0])
    return graph_of_observers(list(observers.values()), title, plan, poses=arguments.poses)


def graph_of_observers(
    observers: Sequence[TreeObserver], title: str, plan: Plan | None = None, *, poses: bool = False
) -> Graph:
    """Return the observed tree as a graph, with second parents, loops and publishers.

    Planned edges that no node publishes are marked as missing.
    """
    from tfcompose.compiler.draw import Arrow, Graph

    edges = [edge for observer in observers for edge in observer.edges(observer.until_ns)]
    children = {edge.stream.child for edge in edges}
    missing = [edge for edge in plan.edges if edge.child not in children] if plan else []
    arrows = [_arrow(edge, poses=poses) for edge in edges]
    arrows += [
        Arrow(edge.parent, edge.child, edge.kind, owner=edge.node, detail="missing", pose="")
        for edge in missing
    ]
    return Graph(printable(title), (), tuple(arrows))


def _arrow(edge: EdgeState, *, poses: bool) -> Arrow:
    from tfcompose.compiler.draw import Arrow

    stream = edge.stream
    rate = "" if stream.static or edge.timing.rate is None else f"{edge.timing.rate:.1f} Hz"
    owner = printable(edge.publisher) or "unknown"
    below = _pose(stream.pose) if poses else ""
    kind: Kind = "static" if stream.static else "dynamic"
    return Arrow(
        printable(stream.parent),
        printable(stream.child),
        kind,
        owner=owner,
        detail=rate,
        pose=below,
    )


def _pose(pose: Pose) -> str:
    from tfcompose.compiler.render.tree import short_pose

    length = norm(pose.quat_xyzw)
    sound = length > 0 and length < float("inf")
    return short_pose(Pose(pose.xyz, normalise(pose.quat_xyzw))) if sound else "no rotation"
