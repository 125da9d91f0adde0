"""Import URDF, xacro, launch files, shell scripts or a running robot.

Write a robot file from a URDF or xacro file, which builds to the same URDF; or from a shell script with ros2 run lines.
Chains of frames that match a preset become sensors. What a robot file cannot say is a TODO comment with its file and
line, and a finding.
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

    from tfcompose.compile import Compiled
    from tfcompose.files import Target
    from tfcompose.findings import Finding
    from tfcompose.importing.draft import Draft
    from tfcompose.urdf.lint import Document
    from tfcompose.urdf.packages import Packages

_LAUNCH = (".py", ".xml", ".launch", ".yaml", ".yml")
_ENDINGS = frozenset({".urdf", ".xacro", ".sh", ".bash", ".txt", "", *_LAUNCH})
_ROBOT = re.compile(r"[a-z][a-z0-9_]*")


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument(
        "file", metavar="FILE", help="a .urdf, .xacro or launch file, or a shell script; -: lines from stdin"
    )
    parser.add_argument("args", nargs="*", metavar="NAME:=VALUE", help="arguments of the xacro or launch file")
    parser.add_argument("-o", "--output", metavar="FILE", help="write the robot file here; default: print it")
    parser.add_argument("--force", action="store_true", help="overwrite an existing file")
    parser.add_argument("--robot", metavar="NAME", help="the robot's name; default: the source's")
    parser.add_argument(
        "--package", action="append", default=[], metavar="NAME=FOLDER", dest="packages",
        help="folder of a package that is not installed; repeatable",
    )  # fmt: skip
    parser.add_argument("--no-sensors", action="store_true", help="keep frames as frames, do not match presets")
    parser.add_argument(
        "--all-branches", action="store_true", help="of a launch file, take what conditions leave out, too"
    )
    parser.add_argument("--keep-going", action="store_true", help="write as much as possible of a source with errors")


def run(arguments: Namespace) -> int:
    """Import; exit code 0, 1 with errors in the source, 2 after wrong use or where something cannot be read."""
    from tfcompose.findings import RejectedError

    _check_use(arguments)
    try:
        if arguments.file.endswith((".urdf", ".xacro")):
            return _import_urdf(arguments)
        return _import_bringup(arguments)
    except RejectedError as error:
        reject(error.findings)


def _import_urdf(arguments: Namespace) -> int:
    from dataclasses import replace

    from tfcompose.urdf.lint import read_urdf

    given, packages = pairs(arguments.args, ":="), pairs(arguments.packages, "=")
    known = _known_packages(packages)
    document = read_urdf(arguments.file, known, given)
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


def _import_bringup(arguments: Namespace) -> int:
    """Import what starts processes: everything that is understood is written, and the rest is named."""
    from tfcompose.cli.reading import STDIN, read_text
    from tfcompose.importing.draft import Draft, robot_name
    from tfcompose.importing.shell import add_script

    name = "stdin" if arguments.file == STDIN else posixpath.basename(arguments.file)
    wanted = arguments.robot or robot_name(name.partition(".")[0] if name != "stdin" else "robot")
    draft = Draft(wanted, [f"imported from {name} by tfcompose"])
    if arguments.file.endswith(_LAUNCH):
        _add_launch(draft, arguments)
    else:
        shown = arguments.file if arguments.file != STDIN else "<stdin>"
        add_script(draft, read_text(arguments.file), shown, _target(arguments))
    return _finish(draft, arguments)


def _add_launch(draft: Draft, arguments: Namespace) -> None:
    from tfcompose.cli.compiling import library
    from tfcompose.cli.reading import read_text
    from tfcompose.importing.descriptions import Workshop, add_descriptions
    from tfcompose.importing.launch import Launch, add_launch

    read_text(arguments.file)  # refuses what is no text
    given, packages = pairs(arguments.args, ":="), pairs(arguments.packages, "=")
    known, target = _known_packages(packages), _target(arguments)
    prefixes = known.disk.prefixes if known.disk else ()
    launch = Launch(arguments.file, given, packages, prefixes, arguments.all_branches)
    folders = {name: str(Path(folder).absolute()) for name, folder in packages.items()}
    descriptions = add_launch(draft, launch, target)
    presets = None if arguments.no_sensors else library()
    add_descriptions(draft, descriptions, Workshop(known, target, presets, folders))


def _finish(draft: Draft, arguments: Namespace) -> int:
    """Write a draft, with what ``lint`` finds in it; return the exit code."""
    from dataclasses import replace

    from tfcompose.importing.draft import text_with_findings

    if draft.is_empty():
        print_findings(draft.found, sys.stderr)
        fail("nothing was written: the source starts nothing that a robot file has")
    text, compiled = text_with_findings(draft, lambda text: _lint(text, arguments))
    _write(text, arguments.output)
    print_findings(draft.found, sys.stderr)
    found = compiled.found if arguments.output else [replace(one, span=None, notes=()) for one in compiled.found]
    print_findings(found, sys.stderr)
    return FAILED if compiled.errors else 0


def _known_packages(packages: dict[str, str]) -> Packages:
    from tfcompose.cli.compiling import disk
    from tfcompose.findings import Span
    from tfcompose.urdf.packages import Packages

    named = {name: (str(Path(folder).absolute()), Span(folder)) for name, folder in packages.items()}
    return Packages(disk(), named, advice="--package {name}=FOLDER, or source the workspace's setup file")


def _check_use(arguments: Namespace) -> None:
    """Refuse names that cannot be, and a file that is there.

    Raises:
        SystemExit: after saying so.
    """
    if Path(arguments.file).suffix not in _ENDINGS:
        fail(f"{arguments.file}: only URDF, xacro and launch files and shell scripts can be imported", UNREADABLE)
    if arguments.robot and not _ROBOT.fullmatch(arguments.robot):
        fail(f"--robot {arguments.robot}: use lower case letters, digits and _, beginning with a letter", UNREADABLE)
    if arguments.output and Path(arguments.output).exists() and not arguments.force:
        fail(f"{arguments.output} exists already; --force overwrites it", UNREADABLE)


def _target(arguments: Namespace) -> Target:
    from tfcompose.files import Target

    return Target("as-written", posixpath.dirname(arguments.output or "") or ".", Path.cwd().as_posix())


def _lint(text: str, arguments: Namespace) -> Compiled:
    from tfcompose.cli.compiling import disk, library
    from tfcompose.cli.reading import read_text
    from tfcompose.compile import compile_robot

    return compile_robot(text, arguments.output or "robot.yaml", library(), read=read_text, disk=disk())


def _robot_file(document: Document, arguments: Namespace, packages: dict[str, str]) -> tuple[str, list[Finding]]:
    """Return the robot file, and the errors that it has where the source has none."""
    from tfcompose.cli.compiling import library
    from tfcompose.importing.robot_file import imported, with_findings

    presets = None if arguments.no_sensors else library()
    robot = imported(document, _target(arguments), arguments.robot or "", packages, presets)
    return with_findings(robot, arguments.file, lambda text: _lint(text, arguments))


def _write(text: str, output: str | None) -> None:
    if output is None:
        sys.stdout.write(text)
        return
    try:
        Path(output).write_text(text, encoding="utf-8")
    except OSError as error:
        fail(f"{output} cannot be written: {error.strerror}", UNREADABLE)
    print(f"wrote {output}")
