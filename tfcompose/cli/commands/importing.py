"""Convert a URDF or xacro file to a robot file.

Write a robot file with the tree, bodies and joints of a URDF or xacro file; building it gives the same URDF. Chains of
frames that match a preset become sensors; comments hold what a robot file cannot express.
"""

from __future__ import annotations

import posixpath
import re
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.cli.options import pairs
from tfcompose.cli.terminal import FAILED, UNREADABLE, fail, print_findings, reject

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace

    from tfcompose.findings import Finding
    from tfcompose.urdf.lint import Document

_ROBOT = re.compile(r"[a-z][a-z0-9_]*")


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument("file", metavar="FILE", help="a .urdf or .xacro file")
    parser.add_argument("args", nargs="*", metavar="NAME:=VALUE", help="arguments of the xacro file")
    parser.add_argument("-o", "--output", metavar="FILE", help="write the robot file here; default: print it")
    parser.add_argument("--force", action="store_true", help="overwrite an existing file")
    parser.add_argument("--robot", metavar="NAME", help="the robot's name; default: the source's")
    parser.add_argument(
        "--package", action="append", default=[], metavar="NAME=FOLDER", dest="packages",
        help="folder of a package that is not installed; repeatable",
    )  # fmt: skip
    parser.add_argument("--no-sensors", action="store_true", help="keep frames as frames, do not match presets")
    parser.add_argument("--keep-going", action="store_true", help="write as much as possible of a source with errors")


def run(arguments: Namespace) -> int:
    """Import; exit code 0, 1 with errors in the source, 2 after wrong use or where something cannot be read."""
    from dataclasses import replace

    from tfcompose.cli.compiling import disk
    from tfcompose.findings import RejectedError, Span
    from tfcompose.urdf.lint import read_urdf
    from tfcompose.urdf.packages import Packages

    given, packages = pairs(arguments.args, ":="), pairs(arguments.packages, "=")
    _check_use(arguments)
    try:
        named = {name: (str(Path(folder).absolute()), Span(folder)) for name, folder in packages.items()}
        known = Packages(disk(), named, advice="--package {name}=FOLDER, or source the workspace's setup file")
        document = read_urdf(arguments.file, known, given)
    except RejectedError as error:
        reject(error.findings)
    errors = [one for one in document.findings() if one.severity == "error"]
    print_findings(errors, sys.stderr)
    if errors and not arguments.keep_going:
        fail("nothing was written; --keep-going writes as much as possible")
    text, more_errors = _robot_file(document, arguments, known.local | packages)
    if more_errors and not arguments.keep_going:
        print_findings([replace(one, span=None) for one in more_errors], sys.stderr)  # places in what is not written
        fail("nothing was written: a robot file cannot express all of the source; --keep-going writes it anyway")
    _write(text, arguments.output)
    return FAILED if errors or more_errors else 0


def _check_use(arguments: Namespace) -> None:
    """Refuse names that cannot be, and a file that is there.

    Raises:
        SystemExit: after saying so.
    """
    if not arguments.file.endswith((".urdf", ".xacro")):
        fail(f"{arguments.file}: only .urdf and .xacro files can be imported", UNREADABLE)
    if arguments.robot and not _ROBOT.fullmatch(arguments.robot):
        fail(f"--robot {arguments.robot}: use lower case letters, digits and _, beginning with a letter", UNREADABLE)
    if arguments.output and Path(arguments.output).exists() and not arguments.force:
        fail(f"{arguments.output} exists already; --force overwrites it", UNREADABLE)


def _robot_file(document: Document, arguments: Namespace, packages: dict[str, str]) -> tuple[str, list[Finding]]:
    """Return the robot file, and the errors that it has where the source has none."""
    from tfcompose.cli.compiling import disk, library
    from tfcompose.cli.reading import read_text
    from tfcompose.compile import Compiled, compile_robot
    from tfcompose.files import Target
    from tfcompose.importing.robot_file import imported, with_findings

    def lint(text: str) -> Compiled:
        return compile_robot(text, arguments.output or "robot.yaml", library(), read=read_text, disk=disk())

    target = Target("as-written", posixpath.dirname(arguments.output or "") or ".", Path.cwd().as_posix())
    presets = None if arguments.no_sensors else library()
    robot = imported(document, target, arguments.robot or "", packages, presets)
    return with_findings(robot, arguments.file, lint)


def _write(text: str, output: str | None) -> None:
    if output is None:
        sys.stdout.write(text)
        return
    try:
        Path(output).write_text(text, encoding="utf-8")
    except OSError as error:
        fail(f"{output} cannot be written: {error.strerror}", UNREADABLE)
    print(f"wrote {output}")
