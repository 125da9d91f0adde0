"""A robot's files, written all or none."""

from __future__ import annotations

import posixpath
import sys
from dataclasses import replace
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.cli.compiling import robot_or_code
from tfcompose.cli.output import write_all
from tfcompose.cli.terminal import UNREADABLE, complain, print_findings
from tfcompose.emit import described, emit
from tfcompose.files import Target, unaddressed
from tfcompose.findings import Finding, finding
from tfcompose.plan import DESCRIPTION

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Iterable

    from tfcompose.files import File, Form
    from tfcompose.model import Asset, Robot


def build(arguments: Namespace) -> tuple[Path, list[str]] | int:
    """Build the robot and return the folder and the names of the files, or the exit code after saying why not."""
    reads_back = getattr(arguments, "read_back", False)
    if reads_back and find_spec("yourdfpy") is None:
        complain("--read-back needs the package yourdfpy: pip install 'tfcompose[view]'")
        return UNREADABLE
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
    unlike = _unlike(robot, written, target) if reads_back else []
    if unlike:
        print_findings(unlike, sys.stderr)
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


def _unlike(robot: Robot, files: Iterable[File], target: Target) -> list[Finding]:
    """Return what the descriptions among the robot's files say otherwise than it; ``target`` is theirs."""
    read_back = import_module("tfcompose.urdf.read_back")
    texts = {file.path: file.text for file in files}
    advice = "nothing was written; this is a fault of tfcompose: report it"
    found = []
    for part, described_robot in described(robot):
        folder = f"{part}/" if part else ""
        inside = replace(target, folder=posixpath.join(target.folder, folder))
        for name, full in ((DESCRIPTION, True), ("robot.urdf", False)):
            path = folder + name
            several = read_back.differences(described_robot, texts[path], inside, full=full)
            found += [finding("TF910", f"{path}: {one}", None, help=advice) for one in several]
    return found


def _no_address(asset: Asset, form: Form) -> Finding:
    """Return the finding that a file cannot be addressed as the command line asks for."""
    if form != "package":
        return finding("TF724", f"{asset.uri} was not found, and has no path", asset.at, help="build without --mesh")
    advice = "a folder with a package.xml above it, packages: {name: FOLDER} and package://name/…, or no --mesh"
    return finding("TF726", f"{asset.uri} is in no package", asset.at, help=advice)
