"""Check robot files and report every problem; needs no ROS.

Report every problem in robot files, with its place. Each file is checked alone and with each of its profiles.
"""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose import __version__
from tfcompose.cli.options import DEFAULT_FILE, add_format, add_variant
from tfcompose.cli.terminal import UNREADABLE, print_findings, unreadable

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace
    from collections.abc import Callable

    from tfcompose.cli.fixing import Fixer
    from tfcompose.findings import Finding
    from tfcompose.resolve import Library

#: What a robot file has at the begin of a line: its first key, or, with that misspelt, two others of its keys.
_ROBOT = re.compile(
    rb"^tfcompose\s*:|\A(?=[\s\S]*^robot\s*:)(?=[\s\S]*^(?:links|joints|frames|sensors|parts)\s*:)", re.MULTILINE
)

URDF_ENDINGS = (".urdf", ".xacro")


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument(
        "files",
        nargs="*",
        metavar="FILE",
        default=[],
        help="robot files, folders of them, or .urdf and .xacro files; default: robot.yaml",
    )
    parser.add_argument(
        "--urdf", action="append", default=[], metavar="FILE", dest="urdfs",
        help="check FILE as a URDF or xacro file, whatever its suffix; repeatable",
    )  # fmt: skip
    add_variant(parser, "check only this combination")
    add_format(parser, "json", "sarif", "github")
    parser.add_argument("--fix", action="store_true", help="apply unambiguous fixes to the named files")
    parser.add_argument(
        "--fail-on", choices=("error", "warning"), default="error", help="lowest severity that exits 1; default: error"
    )


def run(arguments: Namespace) -> int:
    """Lint the files; exit code 0, 1 with findings that count, 2 where a file cannot be read."""
    from tfcompose.cli.compiling import library
    from tfcompose.cli.reading import read_text

    presets = library()
    names = arguments.files or ([] if arguments.urdfs else [DEFAULT_FILE])
    files = dict.fromkeys(file for name in names for file in robots_in(name))
    urdfs = dict.fromkeys([*arguments.urdfs, *(file for file in files if file.endswith(URDF_ENDINGS))])
    robots = [file for file in files if file not in urdfs]
    if arguments.fix:
        from tfcompose.cli.fixing import Fixer

        fixer = Fixer(robots, lambda file, read: lint_file(file, presets, arguments, read))
        found = _fix(fixer, arguments.format)
    else:
        found = [one for file in robots for one in lint_file(file, presets, arguments, read_text)]
    found += [one for file in urdfs for one in _lint_urdf(file)]
    _print(found, arguments.format, len(robots) + len(urdfs))
    if unreadable(found):
        return UNREADABLE
    return int(any(one.severity == "error" or arguments.fail_on == "warning" for one in found))


def _lint_urdf(file: str) -> list[Finding]:
    """Return what is wrong with a URDF or xacro file."""
    from tfcompose.cli.compiling import disk
    from tfcompose.urdf.lint import lint_urdf
    from tfcompose.urdf.packages import Packages

    return lint_urdf(file, Packages(disk(), advice="source the workspace's setup file"))


def _fix(fixer: Fixer, form: str) -> list[Finding]:
    """Fix the files, say what was fixed, and return what remains: everything, where a file cannot be written."""
    from tfcompose.findings import Span, finding

    found = [one for file in fixer.files for one in fixer.fix(file)]
    try:
        fixer.write()
    except OSError as error:
        message = f"cannot be fixed: {error.strerror}"
        return [finding("TF001", message, Span(error.filename or "?"))]
    stream = sys.stdout if form == "text" else sys.stderr
    for one in fixer.fixed:
        now = " … ".join(edit.text.strip(", \n") for edit in one.edits)
        stream.write(f"{one.span}: fixed[{one.code}] {one.message}: now {now}\n")
    return found


def robots_in(name: str) -> list[str]:
    """Return the file itself, or the robot files below a folder: YAML files with a line that begins with tfcompose:."""
    robots: list[str] = []
    for top, folders, files in os.walk(name):
        folders[:] = sorted(inner for inner in folders if not inner.startswith("."))
        paths = [Path(top, file) for file in sorted(files) if file.endswith((".yaml", ".yml"))]
        robots += [str(path) for path in paths if path.is_file() and _is_robot(path)]
    return robots or [name]


def _is_robot(file: Path) -> bool:
    """Return whether it is one, or cannot be read: its own lint says why."""
    from tfcompose.cli.reading import MOST_BYTES

    try:
        with file.open("rb") as stream:
            return bool(_ROBOT.search(stream.read(MOST_BYTES)))
    except OSError:
        return True


def _print(found: list[Finding], form: str, files: int) -> None:
    if form == "text":
        from tfcompose.render.text import summary

        print_findings(found, sys.stdout)
        sys.stdout.write(summary(found, files))
    elif form == "json":
        from tfcompose.render.formats import render_json

        sys.stdout.write(render_json(found))
    elif form == "github":
        from tfcompose.render.formats import render_github

        sys.stdout.write(render_github(found))
    else:
        from tfcompose.pages import page
        from tfcompose.render.formats import render_sarif

        sys.stdout.write(render_sarif(found, __version__, {one.code: page(one.code) for one in found}))


def lint_file(file: str, presets: Library, arguments: Namespace, read: Callable[[str], str]) -> list[Finding]:
    """Return the findings of one file: alone and with each of its profiles, or with what is asked for only."""
    from dataclasses import replace

    from tfcompose.check import unused_allows
    from tfcompose.cli.compiling import disk, overlays_of
    from tfcompose.compile import compile_source
    from tfcompose.findings import Note, RejectedError
    from tfcompose.language import profiles_in, with_includes
    from tfcompose.load import load

    try:
        source = with_includes(load(read(file), file), read)
        overlays = overlays_of(arguments)
    except RejectedError as error:
        return list(error.findings)
    if arguments.profiles or overlays:
        return list(compile_source(source, presets, arguments.profiles, overlays, read, disk()).found)
    alone = compile_source(source, presets, read=read, disk=disk())
    found, used, complete = list(alone.found), set(alone.used), alone.robot is not None
    for profile in profiles_in(source):
        note = Note(f"with --profile {profile}")
        known = {(one.code, one.message, one.span) for one in found}
        variant = compile_source(source, presets, [profile], read=read, disk=disk())
        used |= variant.used
        complete = complete and variant.robot is not None
        found += [
            replace(one, notes=(*one.notes, note))
            for one in variant.found
            if (one.code, one.message, one.span) not in known
        ]
    if complete:  # else a comment may be about what was not looked at
        found += unused_allows(source.allows, used)
    return sorted(found, key=lambda one: one.sort_key)
