"""``tfcompose build``: the robot's files, all of them or nothing.

Write plan.json, the URDF, xacro, tree.txt and tree.svg, and parameter files where there are any: all, or
nothing.
"""

from __future__ import annotations

import sys
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.cli.compiling import robot_or_code
from tfcompose.cli.options import add_file, add_variant
from tfcompose.cli.output import write_all
from tfcompose.cli.terminal import UNREADABLE, complain, print_findings
from tfcompose.diagnostic import Diagnostic, finding
from tfcompose.emit import Target, emit, unaddressed

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace

    from tfcompose.emit import Form
    from tfcompose.model import Asset


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    add_file(parser)
    add_variant(parser)
    parser.add_argument("-o", "--output", metavar="DIR", help="default: build/ROBOT")
    parser.add_argument(
        "--mesh", choices=("package", "file", "relative"), default="as-written",
        help="how meshes are addressed: package://…, file:///…, or relative to DIR; default: as they are written",
    )  # fmt: skip
    parser.add_argument(
        "--read-back", action="store_true",
        help="read the URDF again with another parser, and write only what is the robot, value by value",
    )  # fmt: skip


def run(arguments: Namespace) -> int:
    """Build; exit code 0, 1 with errors in the robot, 2 where something cannot be read or written."""
    built = build(arguments)
    if isinstance(built, int):
        return built
    folder, names = built
    sys.stdout.write(f"wrote {folder}: {', '.join(names)}\n")
    return 0


def build(arguments: Namespace) -> tuple[Path, list[str]] | int:
    """Build the robot and return the folder and the names of the files, or the exit code after saying why not."""
    robot = robot_or_code(arguments.file, arguments)
    if isinstance(robot, int):
        return robot
    form: Form = getattr(arguments, "mesh", "as-written")
    lost = [_no_address(asset, form) for asset in unaddressed(robot, form)]
    if lost:
        print_findings(lost, sys.stderr)
        return 1
    folder = Path(arguments.output) if arguments.output else Path("build") / robot.name
    target = Target(form, folder.as_posix(), Path.cwd().as_posix())
    written = emit(robot, target)
    if getattr(arguments, "read_back", False):  # what reads it is loaded only then
        unlike = import_module("tfcompose.emit.read_back").unlike(robot, written, target)
        if unlike:
            print_findings([_otherwise(path, what) for path, what in unlike], sys.stderr)
            return 1
    try:
        write_all(folder, written)
    except OSError as error:
        where = f": {error.filename}" if error.filename else ""
        complain(f"nothing was written to {folder}: {error.strerror}{where}")
        return UNREADABLE
    return folder, [file.path for file in written]


def _otherwise(path: str, what: str) -> Diagnostic:
    """Return the finding that a description is not the robot's."""
    return finding(
        "TF910", f"{path}: {what}", None, help="nothing was written; this is a fault of tfcompose: report it"
    )


def _no_address(asset: Asset, form: Form) -> Diagnostic:
    """Return the finding that a file cannot be addressed as the command line asks for."""
    if form != "package":
        return finding("TF724", f"{asset.uri} was not found, and has no path", asset.at, help="build without --mesh")
    advice = "a folder with a package.xml above it, packages: {name: FOLDER} and package://name/…, or no --mesh"
    return finding("TF726", f"{asset.uri} is in no package", asset.at, help=advice)
