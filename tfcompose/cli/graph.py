"""``tfcompose graph``: the tree as a picture.

Draw the tree: frames coloured by owner, fixed and moving edges, sensors in frames of their own. The ending of the file
says how: .svg, .pdf, .png, .dot (Graphviz) or .mmd (Mermaid).
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
from tfcompose.cli.options import add_file, add_variant
from tfcompose.cli.terminal import UNREADABLE, complain
from tfcompose.emit.final import with_final_names
from tfcompose.emit.graph import graph_of

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace

    from tfcompose.draw import Graph

#: By the file's ending: the module of ``tfcompose.draw`` that writes it, and whether it writes a drawing.
FORMATS = {".svg": ("svg", True), ".pdf": ("pdf", True), ".png": ("png", True), ".dot": ("dot", False)}
FORMATS |= {".gv": ("dot", False), ".mmd": ("mermaid", False)}
NAMED = "svg, pdf, png, dot or mmd"


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    add_file(parser)
    add_variant(parser)
    parser.add_argument(
        "-o", "--output", default="tree.svg", metavar="PICTURE", help=f"a file that ends in {NAMED}; default: tree.svg"
    )
    parser.add_argument("--poses", action="store_true", help="write each frame's pose in its parent, in m and degrees")


def run(arguments: Namespace) -> int:
    """Draw; exit code 0, 1 with errors in the robot, 2 for another ending or what cannot be read or written."""
    path = Path(arguments.output)
    refused = _refused(path)
    if refused:
        complain(refused)
        return UNREADABLE
    robot = robot_or_code(arguments.file, arguments)
    if isinstance(robot, int):
        return robot
    try:
        _write(path, picture(graph_of(with_final_names(robot), poses=arguments.poses), path.suffix.lower()))
    except OSError as error:
        complain(f"{path} was not written: {error.strerror}")
        return UNREADABLE
    sys.stdout.write(f"wrote {path}\n")
    return 0


def _refused(path: Path) -> str:
    """Return why the picture cannot be written, before anything is done for it; empty if it can."""
    ending = path.suffix.lower()
    if ending not in FORMATS:
        said = f"{path.suffix} is no kind of picture that graph writes" if ending else f"{path} has no ending"
        return f"{said}; -o takes a file that ends in {NAMED}"
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
