"""A robot's files, written all or none."""

from __future__ import annotations

import posixpath
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.cli.compiling import compiled_robot
from tfcompose.cli.terminal import UNREADABLE, fail, reject
from tfcompose.cli.writing import write_all
from tfcompose.emit import described, emit
from tfcompose.files import Target, unaddressed
from tfcompose.findings import Finding, finding
from tfcompose.plan import DESCRIPTION

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Iterable

    from tfcompose.files import File, Form
    from tfcompose.model import Asset, Robot


def build(arguments: Namespace) -> tuple[Path, list[str]]:
    """Build the robot and return the folder and the names of the files.

    Raises:
        SystemExit: after saying why nothing was written.
    """
    reads_back = getattr(arguments, "read_back", False)
    if reads_back and find_spec("yourdfpy") is None:
        fail("--read-back needs the package yourdfpy: pip install 'tfcompose[view]'", UNREADABLE)
    robot = compiled_robot(arguments.file, arguments)
    folder, target = destination(arguments, robot)
    lost = [_without_address(asset, target.form) for asset in unaddressed(robot, target.form)]
    if lost:
        reject(lost)
    files = emit(robot, target)
    different = _differences(robot, files, target) if reads_back else []
    if different:
        reject(different)
    try:
        write_all(folder, files)
    except OSError as error:
        where = f": {error.filename}" if error.filename else ""
        fail(f"nothing was written to {folder}: {error.strerror}{where}", UNREADABLE)
    return folder, [file.path for file in files]


def destination(arguments: Namespace, robot: Robot) -> tuple[Path, Target]:
    """Return the folder that the robot is built in, and how the files in it name others."""
    folder = Path(arguments.output) if arguments.output else Path("build") / robot.name
    form: Form = getattr(arguments, "mesh", "as-written")
    return folder, Target(form, folder.as_posix(), Path.cwd().as_posix())


def _differences(robot: Robot, files: Iterable[File], target: Target) -> list[Finding]:
    """Return where the descriptions among the robot's files differ from it when they are read back."""
    from tfcompose.urdf.read_back import differences

    texts = {file.path: file.text for file in files}
    advice = "nothing was written; this is a bug in tfcompose: please report it"
    found = []
    for part, described_robot in described(robot):
        folder = f"{part}/" if part else ""
        inside = replace(target, folder=posixpath.join(target.folder, folder))
        for name, full in ((DESCRIPTION, True), ("robot.urdf", False)):
            path = folder + name
            several = differences(described_robot, texts[path], inside, full=full)
            found += [finding("TF910", f"{path}: {one}", None, help=advice) for one in several]
    return found


def _without_address(asset: Asset, form: Form) -> Finding:
    """Return the finding that a file cannot be addressed as the command line asks for."""
    if form != "package":
        return finding("TF724", f"{asset.uri} was not found and has no path", asset.at, help="build without --mesh")
    advice = "a folder with a package.xml above it, packages: {name: FOLDER} and package://name/…, or no --mesh"
    return finding("TF726", f"{asset.uri} is in no package", asset.at, help=advice)
