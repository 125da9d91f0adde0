"""``tfcompose lint``: everything that is wrong, with places.

Find everything that is wrong with robot files, with places. Each file is checked alone and with each of its profiles.
"""

from __future__ import annotations

import os
import re
import sys
from dataclasses import replace
from importlib import import_module
from typing import TYPE_CHECKING

from tfcompose import __version__
from tfcompose.check import unused_allows
from tfcompose.cli.compiling import library, overlays_of
from tfcompose.cli.disk import disk
from tfcompose.cli.options import DEFAULT_FILE, add_variant
from tfcompose.cli.terminal import UNREADABLE, print_findings, read_text, unreadable
from tfcompose.compile import compile_source, profiles_of
from tfcompose.findings import Finding, Note, RejectedError, Span, finding
from tfcompose.language import with_includes
from tfcompose.load import load
from tfcompose.render.text import summary

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace
    from collections.abc import Callable

    from tfcompose.cli.fixing import Fixer
    from tfcompose.resolve import Library


_ROBOT = re.compile(rb"^tfcompose\s*:", re.MULTILINE)

URDF_ENDINGS = (".urdf", ".xacro")
FORMATS = ("text", "json", "sarif", "github")


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument(
        "files",
        nargs="*",
        metavar="FILE",
        default=[],
        help="files, or folders of robot files, or .urdf and .xacro files; default: robot.yaml",
    )
    parser.add_argument(
        "--urdf", action="append", default=[], metavar="FILE", dest="urdfs",
        help="a URDF or xacro file that somebody else wrote, whatever its name; repeatable",
    )  # fmt: skip
    add_variant(parser, "check this combination only")
    parser.add_argument("--format", choices=FORMATS, default="text", help="default: text")
    parser.add_argument("--fix", action="store_true", help="mend what has one safe answer, in the files that are named")
    parser.add_argument(
        "--fail-on", choices=("error", "warning"), default="error", help="what makes the exit code 1; default: error"
    )


def run(arguments: Namespace) -> int:
    """Lint the files; exit code 0, 1 with findings that count, 2 where a file cannot be read."""
    presets = library()
    found: list[Finding] = []
    names = arguments.files or ([] if arguments.urdfs else [DEFAULT_FILE])
    files = dict.fromkeys(file for name in names for file in robots_in(name))
    urdfs = dict.fromkeys([*arguments.urdfs, *(file for file in files if file.endswith(URDF_ENDINGS))])
    files = {file: None for file in files if file not in urdfs}
    if arguments.fix:
        fixer = import_module("tfcompose.cli.fixing").Fixer(
            list(files), lambda file, read: lint_file(file, presets, arguments, read)
        )
        found = _fixed(fixer, arguments.format)
    else:
        for file in files:
            found += lint_file(file, presets, arguments)
    for file in urdfs:
        found += _urdf_findings(file)
    _print(found, arguments.format, len(files) + len(urdfs))
    if unreadable(found):
        return UNREADABLE
    return int(any(one.severity == "error" or arguments.fail_on == "warning" for one in found))


def _urdf_findings(file: str) -> list[Finding]:
    """Return what is wrong with a URDF or xacro file; what reads them is loaded only here."""
    from tfcompose.urdf.lint import lint_urdf
    from tfcompose.urdf.packages import Packages

    files = disk()
    return lint_urdf(file, Packages(files, otherwise="source the workspace's setup file"), files)


def _fixed(fixer: Fixer, form: str) -> list[Finding]:
    """Fix the files, say what was fixed, and return what remains: everything, where a file cannot be written."""
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
    if not os.path.isdir(name):
        return [name]
    robots: list[str] = []
    for top, folders, files in os.walk(name):
        folders[:] = sorted(inner for inner in folders if not inner.startswith("."))
        paths = [os.path.join(top, file) for file in sorted(files) if file.endswith((".yaml", ".yml"))]
        robots += [os.path.normpath(path) for path in paths if os.path.isfile(path) and _is_robot(path)]
    return robots or [name]


def _is_robot(path: str) -> bool:
    with open(path, "rb") as file:
        return bool(_ROBOT.search(file.read()))


def _print(found: list[Finding], form: str, files: int) -> None:
    if form == "text":
        print_findings(found, sys.stdout)
        sys.stdout.write(summary(found, files))
    elif form == "json":
        sys.stdout.write(import_module("tfcompose.render.json").render_json(found))
    elif form == "github":
        sys.stdout.write(import_module("tfcompose.render.github").render_github(found))
    else:
        page = import_module("tfcompose.pages").page
        pages = {one.code: page(one.code) for one in found}
        sys.stdout.write(import_module("tfcompose.render.sarif").render_sarif(found, __version__, pages))


def lint_file(
    file: str, presets: Library, arguments: Namespace, read: Callable[[str], str] = read_text
) -> list[Finding]:
    """Return the findings of one file: alone and with each of its profiles, or with what is asked for only."""
    try:
        source = with_includes(load(read(file), file), read)
        overlays = overlays_of(arguments)
    except RejectedError as error:
        return list(error.findings)
    if arguments.profiles or overlays:
        return list(compile_source(source, presets, arguments.profiles, overlays, read, disk()).found)
    alone = compile_source(source, presets, read=read, disk=disk())
    found, used, looked = list(alone.found), set(alone.used), alone.robot is not None
    for profile in profiles_of(source):
        note = Note(f"with --profile {profile}")
        known = {(one.code, one.message, one.span) for one in found}
        variant = compile_source(source, presets, [profile], read=read, disk=disk())
        used |= variant.used
        looked = looked and variant.robot is not None
        found += [
            replace(one, notes=(*one.notes, note))
            for one in variant.found
            if (one.code, one.message, one.span) not in known
        ]
    if looked:  # else a comment may be about what was not looked at
        found += unused_allows(source.allows, used)
    return sorted(found, key=lambda one: one.sort_key)
