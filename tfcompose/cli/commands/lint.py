"""Check robot files and report every problem; needs no ROS.

Report every problem in robot files, with its location. Check each file without a profile, with
each of its profiles, and with the combinations of values of its args.
"""

from __future__ import annotations

import sys
import time
from argparse import ArgumentTypeError
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose import __version__
from tfcompose.cli.options import DEFAULT_FILE, add_format, add_variant
from tfcompose.cli.robot_search import YAML_ENDINGS, is_checked, robots_in
from tfcompose.cli.terminal import (
    CLEAR,
    MOST_OF_ONE_CODE,
    UNREADABLE,
    can_redraw,
    code_url,
    exit_code_of,
    fail,
    has_reader,
    print_findings,
)

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace
    from collections.abc import Callable, Mapping

    from tfcompose.cli.fixing import Fixer
    from tfcompose.foundation.findings import Finding

    _Stamp = tuple[int, int] | None

URDF_ENDINGS = (".urdf", ".xacro")
#: Interval between the checks of the files by --watch, in seconds.
CHECK_EVERY_S = 0.3


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument(
        "files",
        nargs="*",
        metavar="FILE",
        default=[],
        help=(
            "robot files, folders of them, .urdf, .xacro and .test.yaml files, or - for standard"
            " input; default: robot.yaml"
        ),
    )
    parser.add_argument(
        "--urdf",
        action="append",
        default=[],
        metavar="FILE",
        dest="urdfs",
        help="check FILE as a URDF or xacro file, whatever its suffix; repeatable",
    )
    add_variant(parser, "check only with this profile", "each robot of the folder in turn")
    add_format(parser, "json", "sarif", "github", "junit")
    parser.add_argument(
        "--fix", action="store_true", help="apply unambiguous fixes to the named files"
    )
    parser.add_argument(
        "--diff",
        action="store_true",
        help="print the changes of --fix, and write nothing; exit 1 if there are any",
    )
    parser.add_argument(
        "--fail-on",
        choices=("error", "warning"),
        default="error",
        help="lowest severity that exits 1; default: error",
    )
    parser.add_argument(
        "--select",
        action="extend",
        type=codes,
        default=[],
        metavar="CODES",
        help=(
            "report only these codes or prefixes (TF401,TF7); errors that prevent a build are "
            "always reported"
        ),
    )
    parser.add_argument(
        "--ignore",
        action="extend",
        type=codes,
        default=[],
        metavar="CODES",
        help="do not report these codes",
    )
    parser.add_argument(
        "--all",
        action="store_true",
        help=f"print all findings, not only the first {MOST_OF_ONE_CODE} per code and file",
    )
    parser.add_argument(
        "--skip-foreign",
        action="store_true",
        help="skip named YAML files that are not robot files",
    )
    parser.add_argument(
        "--untrusted",
        action="store_true",
        help=("for untrusted files, as in CI: read only the robot's own tree and no environment"),
    )
    parser.add_argument(
        "-w",
        "--watch",
        action="store_true",
        help="check again whenever a file changes, until Ctrl-C",
    )


def codes(text: str) -> list[str]:
    """Parse codes or prefixes of codes, separated by commas.

    Raises:
        ArgumentTypeError: if no code matches, or if none of the matching codes may be silenced.
    """
    from tfcompose.foundation.catalogue import CATALOGUE, absent_code

    beginnings = [part.strip() for part in text.split(",")]
    for beginning in beginnings:
        named = [CATALOGUE[code] for code in CATALOGUE if beginning and code.startswith(beginning)]
        if not named:
            raise ArgumentTypeError(
                absent_code(beginning)
                or f"unknown code {beginning}; tfcompose explain --table lists all codes"
            )
        if not any(code.can_be_allowed for code in named):
            raise ArgumentTypeError(
                f"{beginning} is always reported: it prevents reading or building the robot"
            )
    return beginnings


def run(arguments: Namespace) -> int:
    """Lint the files. Return 0, 1 with findings that count, 2 if a file cannot be read."""
    from tfcompose.cli.reading import STDIN, read_text

    if (arguments.fix or arguments.diff or arguments.watch) and STDIN in arguments.files:
        fail("standard input cannot be fixed or watched: name a file", UNREADABLE)
    if (arguments.diff or arguments.watch) and arguments.format != "text":
        fail("--diff and --watch print text: leave out --format", UNREADABLE)
    if arguments.untrusted:
        for option in ("fix", "diff", "trust"):
            if getattr(arguments, option):
                fail(f"--untrusted only reports: leave out --{option}", UNREADABLE)
    from tfcompose.cli.untrusted import without_environment

    with without_environment(applies=arguments.untrusted) as environment:
        if arguments.watch:
            return _watch(arguments, environment)
        return _lint(arguments, environment, read_text)


def _lint(
    arguments: Namespace,
    environment: Mapping[str, str],
    read: Callable[[str], str],
    on_folder: Callable[[str], object] = lambda _: None,
) -> int:
    """Lint the files once and return the exit code.

    ``on_folder`` is called with each folder of overlays before it is listed.
    """
    from tfcompose.cli.compiling import library
    from tfcompose.cli.linting import Linter

    files = _files(arguments)
    has_one_file = len(files) + len(arguments.urdfs) == 1
    linter = Linter(
        arguments, library(), environment, has_one_file=has_one_file, on_folder=on_folder
    )
    urdfs = dict.fromkeys(
        [*arguments.urdfs, *(file for file in files if file.endswith(URDF_ENDINGS))]
    )
    robots = [file for file in files if file not in urdfs]

    def lint(file: str, read: Callable[[str], str]) -> list[Finding]:
        return _select_findings(linter.lint(file, read), arguments)

    is_changed = False
    if arguments.fix or arguments.diff:
        from tfcompose.cli.fixing import Fixer

        fixer = Fixer(robots, lint)
        cases = _fix(fixer, arguments)
        is_changed = bool(arguments.diff and fixer.texts)
    else:
        cases = {file: lint(file, read) for file in robots}
    cases |= {file: _select_findings(linter.lint_urdf(file, read), arguments) for file in urdfs}
    findings = [finding for case in cases.values() for finding in case]
    _print(cases, arguments, len(robots) + len(urdfs))
    if exit_code_of(findings) == UNREADABLE:
        return UNREADABLE
    return int(is_changed or any(finding.severity in _failing(arguments) for finding in findings))


def _watch(arguments: Namespace, environment: Mapping[str, str]) -> int:
    """Lint again whenever a file that was read changes, or a folder contains a new file.

    Ctrl-C ends the loop.
    """
    from tfcompose.cli.reading import forget_lines, read_text

    state: dict[str, _Stamp] = {}

    def remember(path: str) -> None:
        state.setdefault(path, _stamp(path))

    def remembering(file: str) -> str:
        remember(file)
        return read_text(file)

    while True:
        if can_redraw(sys.stdout):
            sys.stdout.write(CLEAR)
        state.clear()
        state |= _stamps(arguments)
        _lint(arguments, environment, remembering, remember)
        sys.stdout.write("watching; Ctrl-C ends it\n")
        sys.stdout.flush()
        while _stamps(arguments) | {file: _stamp(file) for file in state} == state:
            if not has_reader(sys.stdout):
                raise BrokenPipeError
            time.sleep(CHECK_EVERY_S)
        forget_lines()


def _stamps(arguments: Namespace) -> dict[str, _Stamp]:
    """Return the stamps of the named files."""
    return {
        file: _stamp(file) for file in (*_files(arguments), *arguments.urdfs, *arguments.overlays)
    }


def _stamp(file: str) -> _Stamp:
    """Return the modification time and size of a file or folder, None if it does not exist.

    A folder's modification time is that of the last file that came or went.
    """
    try:
        status = Path(file).stat()
    except (OSError, ValueError):
        return None
    return status.st_mtime_ns, status.st_size


def _files(arguments: Namespace) -> list[str]:
    """Return the named files, and the files in named folders."""
    names = arguments.files or ([] if arguments.urdfs else [DEFAULT_FILE])
    files = dict.fromkeys(file for name in names for file in robots_in(name))
    if not arguments.skip_foreign:
        return list(files)
    return [file for file in files if not file.endswith(YAML_ENDINGS) or is_checked(file)]


def _select_findings(findings: list[Finding], arguments: Namespace) -> list[Finding]:
    """Return the findings that --select and --ignore do not remove."""
    from tfcompose.foundation.catalogue import CATALOGUE

    select, ignore = tuple(arguments.select), tuple(arguments.ignore)
    return [
        finding
        for finding in findings
        if not CATALOGUE[finding.code].can_be_allowed
        or (
            (not select or finding.code.startswith(select)) and not finding.code.startswith(ignore)
        )
    ]


def _failing(arguments: Namespace) -> frozenset[str]:
    """Return the severities for which the exit code is 1."""
    return frozenset({"error"} if arguments.fail_on == "error" else {"error", "warning"})


def _fix(fixer: Fixer, arguments: Namespace) -> dict[str, list[Finding]]:
    """Fix the files, or print the differences, and return each file's remaining findings.

    If a file cannot be written, return only the finding about that.
    """
    from tfcompose.foundation.findings import Span, finding

    remaining = {file: fixer.fix(file) for file in fixer.files}
    if arguments.diff:
        sys.stdout.writelines(fixer.diff())
        return remaining
    try:
        fixer.write()
    except OSError as error:
        name = error.filename or "?"
        return {name: [finding("TF001", f"cannot be fixed: {error.strerror}", Span(name))]}
    stream = sys.stdout if arguments.format == "text" else sys.stderr
    for fixed in fixer.fixed:
        now = " … ".join(edit.text.strip(", \n") for edit in fixed.edits)
        stream.write(f"{fixed.span}: fixed[{fixed.code}] {fixed.message}: now {now}\n")
    return remaining


def _print(cases: dict[str, list[Finding]], arguments: Namespace, files: int) -> None:
    """Print the findings of each file, on stderr if stdout contains differences."""
    form, findings = arguments.format, [finding for case in cases.values() for finding in case]
    if form == "text":
        from tfcompose.compiler.render.text import summary

        stream = sys.stderr if arguments.diff else sys.stdout
        print_findings(findings, stream, most=None if arguments.all else MOST_OF_ONE_CODE)
        stream.write(summary(findings, files, warnings_fail=arguments.fail_on == "warning"))
    elif form == "json":
        from tfcompose.compiler.render.formats import render_json

        sys.stdout.write(render_json(findings))
    elif form == "github":
        from tfcompose.compiler.render.formats import render_github

        sys.stdout.write(render_github(findings))
    elif form == "junit":
        from tfcompose.compiler.render.formats import render_junit

        rows = [("lint", file, tuple(case)) for file, case in cases.items()]
        sys.stdout.write(render_junit("tfcompose", rows, failing=_failing(arguments), seconds=0.0))
    else:
        from tfcompose.compiler.render.formats import render_sarif

        sys.stdout.write(render_sarif(findings, __version__, code_url))
