"""``tfcompose graph``: the tree as a picture.

Draw the tree: frames coloured by owner, fixed and moving edges, sensors in frames of their own. The ending of the file
says how: .svg, .pdf, .png, .dot (Graphviz) or .mmd (Mermaid). With --live or --bag it is the published tree, coloured
by publisher; second parents and loops are drawn as they are, and with FILE what is missing.
"""

from __future__ import annotations

import os
import sys
import tempfile
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tfcompose.cli.compiling import robot_or_code
from tfcompose.cli.looking import add_for
from tfcompose.cli.options import DEFAULT_FILE, add_variant, namespace
from tfcompose.cli.terminal import UNREADABLE, complain
from tfcompose.render.tree import graph_of

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace

    from tfcompose.draw import Graph

#: By the file's ending: the module of ``tfcompose.draw`` that writes it, and whether it writes a drawing.
FORMATS = {".svg": ("svg", True), ".pdf": ("pdf", True), ".png": ("png", True), ".dot": ("dot", False)}
FORMATS |= {".gv": ("dot", False), ".mmd": ("mermaid", False)}
NAMED = "svg, pdf, png, dot or mmd"


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument("file", nargs="?", metavar="FILE", help="default: robot.yaml; with --live or --bag: none")
    add_variant(parser)
    parser.add_argument(
        "-o", "--output", default="tree.svg", metavar="PICTURE", help=f"a file that ends in {NAMED}; default: tree.svg"
    )
    parser.add_argument(
        "--live", action="store_true", help="the tree that is published now; with FILE what is missing too"
    )
    parser.add_argument("--bag", metavar="BAG", help="the tree of a recording: a rosbag2 folder, .mcap or .db3")
    add_for(parser, "with --live: look so long; default: 3", 3.0)
    parser.add_argument(
        "--namespace", type=namespace, default="", metavar="NS", help="/NS/tf and /NS/tf_static instead, without FILE"
    )
    parser.add_argument("--poses", action="store_true", help="write each frame's pose in its parent, in m and degrees")


def run(arguments: Namespace) -> int:
    """Draw; exit code 0, 1 with errors in the robot, 2 for another ending or what cannot be read or written."""
    path = Path(arguments.output)
    refused = _refused(path)
    if refused:
        complain(refused)
        return UNREADABLE
    graph = _graph(arguments)
    if isinstance(graph, int):
        return graph
    try:
        _write(path, picture(graph, path.suffix.lower()))
    except OSError as error:
        complain(f"{path} was not written: {error.strerror}")
        return UNREADABLE
    sys.stdout.write(f"wrote {path}\n")
    return 0


def _graph(arguments: Namespace) -> Graph | int:
    """Return what is to be drawn, or the exit code after saying what is wrong."""
    if arguments.live or arguments.bag:
        published: Graph | int = import_module("tfcompose.cli.live_graph").seen(arguments)
        return published
    robot = robot_or_code(arguments.file or DEFAULT_FILE, arguments)
    return robot if isinstance(robot, int) else graph_of(robot.with_final_names(), poses=arguments.poses)


def _refused(path: Path) -> str:
    """Return why the picture cannot be written, before anything is done for it; empty if it can."""
    ending = path.suffix.lower()
    if ending not in FORMATS:
        said = f"{path.suffix} is no kind of picture that graph writes" if ending else f"{path} has no ending"
        return f"{said}; -o takes a file that ends in {NAMED}"
    if not path.parent.is_dir():
        return f"{path} cannot be written: there is no folder {path.parent}"
    if ending == ".png" and find_spec("pypdfium2") is None:
        return "PNG needs the package pypdfium2: pip install 'tfcompose[pictures]'; svg and pdf need nothing"
    return ""


def _write(path: Path, data: bytes) -> None:
    """Write the file whole; who looks at it meanwhile sees the one before."""
    if path.is_symlink() or (path.exists() and not path.is_file()):  # a device, a pipe, or somebody's arrangement
        path.write_bytes(data)
        return
    descriptor, name = tempfile.mkstemp(prefix=".tfcompose-", dir=path.parent)
    try:
        with os.fdopen(descriptor, "wb") as stream:
            stream.write(data)
        mode = path.stat().st_mode & 0o777 if path.exists() else 0o666 & ~_umask()
        Path(name).chmod(mode)
        Path(name).replace(path)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def picture(graph: Graph, ending: str) -> bytes:
    """Return the graph as a file with this ending; only what it needs is loaded."""
    name, drawn = FORMATS[ending]
    write: Any = getattr(import_module(f"tfcompose.draw.{name}"), name)
    data: str | bytes = write(import_module("tfcompose.draw.picture").draw(graph) if drawn else graph)
    return data.encode("utf-8") if isinstance(data, str) else data
