"""A robot's files, written all or none."""

from __future__ import annotations

import sys
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.cli.compiling import robot_or_code
from tfcompose.cli.output import write_all
from tfcompose.cli.terminal import UNREADABLE, complain, print_findings
from tfcompose.emit import emit
from tfcompose.files import Target, unaddressed
from tfcompose.findings import Finding, finding

if TYPE_CHECKING:
    from argparse import Namespace

    from tfcompose.files import Form
    from tfcompose.model import Asset, Robot


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
    folder, target = destination(arguments, robot)
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


def destination(arguments: Namespace, robot: Robot) -> tuple[Path, Target]:
    """Return the folder that the robot is built in, and how the files in it name others."""
    folder = Path(arguments.output) if arguments.output else Path("build") / robot.name
    form: Form = getattr(arguments, "mesh", "as-written")
    return folder, Target(form, folder.as_posix(), Path.cwd().as_posix())


def _otherwise(path: str, what: str) -> Finding:
    """Return the finding that a description is not the robot's."""
    return finding(
        "TF910", f"{path}: {what}", None, help="nothing was written; this is a fault of tfcompose: report it"
    )


def _no_address(asset: Asset, form: Form) -> Finding:
    """Return the finding that a file cannot be addressed as the command line asks for."""
    if form != "package":
        return finding("TF724", f"{asset.uri} was not found, and has no path", asset.at, help="build without --mesh")
    advice = "a folder with a package.xml above it, packages: {name: FOLDER} and package://name/…, or no --mesh"
    return finding("TF726", f"{asset.uri} is in no package", asset.at, help=advice)
