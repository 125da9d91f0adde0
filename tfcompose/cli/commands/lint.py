"""Check robot files and report every problem; needs no ROS.

Report every problem in robot files, with its place. Each file is checked alone and with each of
its profiles, and alone in the combinations of values that its args can have.
"""

from __future__ import annotations

import os
import re
import sys
import time
from argparse import ArgumentTypeError
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from tfcompose import __version__
from tfcompose.cli.options import DEFAULT_FILE, add_format, add_variant
from tfcompose.cli.terminal import (
    UNREADABLE,
    can_redraw,
    exit_code_of,
    fail,
    has_reader,
    print_findings,
    warn,
)

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace
    from collections.abc import Callable, Mapping, Sequence

    from tfcompose.cli.fixing import Fixer
    from tfcompose.compiler.compile import Compiled
    from tfcompose.compiler.resolve import Disk, Library
    from tfcompose.foundation.findings import Finding
    from tfcompose.spec.language import Given
    from tfcompose.spec.load import Source

    _Stamp = tuple[int, int] | None

#: What a robot file has at the begin of a line: its first key, or, with that misspelt, two others
#: of its keys.
_ROBOT = re.compile(
    rb"^tfcompose\s*:|\A(?=[\s\S]*^robot\s*:)(?=[\s\S]*^(?:links|joints|frames|sensors|parts)\s*:)",
    re.MULTILINE,
)

URDF_ENDINGS = (".urdf", ".xacro")
_YAML = (".yaml", ".yml")
#: How often --watch checks the files, in seconds.
CHECK_EVERY_S = 0.3
#: For how long a file is judged in combinations of its arguments, in seconds; the first is always
#: judged.
JUDGE_FOR_S = 60.0
#: After this time a search for robot files says what it does, in seconds.
SAY_AFTER_S = 5.0
#: What the kernel shows as files: reading some waits, or does something.
_OF_KERNEL = frozenset({"/proc", "/sys", "/dev"})
#: Moves the cursor home and clears the screen (ECMA-48).
CLEAR = "\033[H\033[2J"


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument(
        "files",
        nargs="*",
        metavar="FILE",
        default=[],
        help=(
            "robot files, folders of them, .urdf and .xacro files, or - for standard input;"
            " default: robot.yaml"
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
    add_variant(parser, "check only this combination")
    add_format(parser, "json", "sarif", "github", "junit")
    parser.add_argument(
        "--fix", action="store_true", help="apply unambiguous fixes to the named files"
    )
    parser.add_argument(
        "--diff",
        action="store_true",
        help="print what --fix would change, and write nothing; exit code 1 if anything",
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
            "report only these codes, or codes that begin so: TF401,TF7; what prevents a build "
            "is always reported"
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
        "--skip-foreign",
        action="store_true",
        help="skip named YAML files that are not robot files",
    )
    parser.add_argument(
        "--untrusted",
        action="store_true",
        help=(
            "for files of strangers, as in CI: read nothing but a robot's own tree, and no "
            "environment"
        ),
    )
    parser.add_argument(
        "-w",
        "--watch",
        action="store_true",
        help="check again whenever a file changes, until Ctrl-C",
    )


def codes(text: str) -> list[str]:
    """Read codes, or what they begin with, separated by commas.

    Raises:
        ArgumentTypeError: if there is no such code, or none that may be silenced.
    """
    from tfcompose.foundation.catalogue import CATALOGUE

    beginnings = [one.strip() for one in text.split(",")]
    for one in beginnings:
        named = [CATALOGUE[code] for code in CATALOGUE if one and code.startswith(one)]
        if not named:
            raise ArgumentTypeError(
                f"there is no code {one}; tfcompose explain --table lists them"
            )
        if not any(code.can_be_allowed for code in named):
            raise ArgumentTypeError(
                f"{one} is reported always: without it a robot cannot be read or built"
            )
    return beginnings


def run(arguments: Namespace) -> int:
    """Lint the files; exit code 0, 1 with findings that count, 2 where a file cannot be read."""
    from tfcompose.cli.reading import STDIN, read_text

    if (arguments.fix or arguments.diff or arguments.watch) and STDIN in arguments.files:
        fail("standard input cannot be fixed or watched: name a file", UNREADABLE)
    if (arguments.diff or arguments.watch) and arguments.format != "text":
        fail("--diff and --watch are for people: leave out --format", UNREADABLE)
    if arguments.untrusted:
        for option in ("fix", "diff", "trust"):
            if getattr(arguments, option):
                fail(f"--untrusted reports, and trusts nothing: leave out --{option}", UNREADABLE)
    from tfcompose.cli.untrusted import without_environment

    with without_environment(applies=arguments.untrusted) as environment:
        arguments.environment = environment
        return _watch(arguments) if arguments.watch else _lint(arguments, read_text)


def _lint(arguments: Namespace, read: Callable[[str], str]) -> int:
    """Lint the files once and return the exit code."""
    from tfcompose.cli.compiling import library

    presets = library()
    files = _files(arguments)
    urdfs = dict.fromkeys(
        [*arguments.urdfs, *(file for file in files if file.endswith(URDF_ENDINGS))]
    )
    robots = [file for file in files if file not in urdfs]

    arguments.is_one = len(files) + len(arguments.urdfs) == 1

    def lint(file: str, read: Callable[[str], str]) -> list[Finding]:
        return _selected(lint_file(file, presets, arguments, read), arguments)

    is_changed = False
    if arguments.fix or arguments.diff:
        from tfcompose.cli.fixing import Fixer

        fixer = Fixer(robots, lint)
        cases = _fix(fixer, arguments)
        is_changed = bool(arguments.diff and fixer.texts)
    else:
        cases = {file: lint(file, read) for file in robots}
    cases |= {file: _selected(_lint_urdf(file, arguments, read), arguments) for file in urdfs}
    found = [one for case in cases.values() for one in case]
    _print(cases, arguments, len(robots) + len(urdfs))
    if exit_code_of(found) == UNREADABLE:
        return UNREADABLE
    return int(is_changed or any(one.severity in _failing(arguments) for one in found))


def _watch(arguments: Namespace) -> int:
    """Lint again whenever a file changes that was read, or one comes to a folder.

    Ctrl-C ends it.
    """
    from tfcompose.cli.reading import forget_lines, read_text

    state: dict[str, _Stamp] = {}

    def remembering(file: str) -> str:
        state.setdefault(file, _stamp(file))
        return read_text(file)

    while True:
        if can_redraw(sys.stdout):
            sys.stdout.write(CLEAR)
        state.clear()
        state |= _stamps(arguments)
        _lint(arguments, remembering)
        sys.stdout.write("watching; Ctrl-C ends it\n")
        sys.stdout.flush()
        while _stamps(arguments) | {file: _stamp(file) for file in state} == state:
            if not has_reader(sys.stdout):
                raise BrokenPipeError
            time.sleep(CHECK_EVERY_S)
        forget_lines()


def _stamps(arguments: Namespace) -> dict[str, _Stamp]:
    """Return the stamps of the files that are named."""
    return {
        file: _stamp(file) for file in (*_files(arguments), *arguments.urdfs, *arguments.overlays)
    }


def _stamp(file: str) -> _Stamp:
    """Return the file's time of change and size, or None if it is not there."""
    try:
        found = Path(file).stat()
    except (OSError, ValueError):
        return None
    return found.st_mtime_ns, found.st_size


def _files(arguments: Namespace) -> list[str]:
    """Return the files that are named, those of folders among them."""
    names = arguments.files or ([] if arguments.urdfs else [DEFAULT_FILE])
    files = dict.fromkeys(file for name in names for file in robots_in(name))
    if not arguments.skip_foreign:
        return list(files)
    return [file for file in files if not file.endswith(_YAML) or is_robot(file)]


def _selected(found: list[Finding], arguments: Namespace) -> list[Finding]:
    """Return the findings that --select and --ignore leave."""
    from tfcompose.foundation.catalogue import CATALOGUE

    select, ignore = tuple(arguments.select), tuple(arguments.ignore)
    return [
        one
        for one in found
        if not CATALOGUE[one.code].can_be_allowed
        or ((not select or one.code.startswith(select)) and not one.code.startswith(ignore))
    ]


def _failing(arguments: Namespace) -> frozenset[str]:
    """Return the severities that make the exit code 1."""
    return frozenset({"error"} if arguments.fail_on == "error" else {"error", "warning"})


def _lint_urdf(file: str, arguments: Namespace, read: Callable[[str], str]) -> list[Finding]:
    """Return what is wrong with a URDF or xacro file."""
    from tfcompose.cli.compiling import disk
    from tfcompose.compiler.urdf.lint import lint_urdf
    from tfcompose.compiler.urdf.packages import Packages

    if arguments.untrusted:
        from tfcompose.cli.untrusted import UntrustedFiles

        files = UntrustedFiles(file, read).disk()
    else:
        files = disk(trusts_files=arguments.trust)
    packages = Packages(files, advice="source the workspace's setup file")
    return lint_urdf(file, packages, arguments.given)


def _fix(fixer: Fixer, arguments: Namespace) -> dict[str, list[Finding]]:
    """Fix the files, or print the difference, and return what remains in each.

    A file that cannot be written, alone.
    """
    from tfcompose.foundation.findings import Span, finding

    found = {file: fixer.fix(file) for file in fixer.files}
    if arguments.diff:
        sys.stdout.writelines(fixer.diff())
        return found
    try:
        fixer.write()
    except OSError as error:
        name = error.filename or "?"
        return {name: [finding("TF001", f"cannot be fixed: {error.strerror}", Span(name))]}
    stream = sys.stdout if arguments.format == "text" else sys.stderr
    for one in fixer.fixed:
        now = " … ".join(edit.text.strip(", \n") for edit in one.edits)
        stream.write(f"{one.span}: fixed[{one.code}] {one.message}: now {now}\n")
    return found


def robots_in(name: str) -> list[str]:
    """Return the file itself, or the robot files below a folder.

    Those are YAML files with a line that begins with tfcompose:. Folders that hold no files of
    people, and those on other file systems, as ``find -xdev`` has them, are left out.
    """
    from tfcompose.foundation.reading import is_file

    robots: list[str] = []
    progress = _Progress(name)
    device = _device(name)
    for top, folders, files in os.walk(name):
        folders[:] = [
            folder
            for folder in sorted(folders)
            if not folder.startswith(".") and _is_searched(f"{top}/{folder}", device)
        ]
        paths = [str(Path(top, file)) for file in sorted(files) if file.endswith(_YAML)]
        robots += [path for path in paths if is_file(path) and is_robot(path)]
        progress.count_files(len(paths))
    return robots or [name]


class _Progress:
    """Says what a long search does, once."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._say_at = time.monotonic() + SAY_AFTER_S
        self._files = 0

    def count_files(self, count: int) -> None:
        """Count YAML files that were looked at."""
        self._files += count
        if time.monotonic() >= self._say_at:
            self._say_at = float("inf")
            warn(
                f"looking for robot files below {self._name}: {self._files} YAML files so far;"
                " name a folder with fewer to be faster"
            )


def _device(folder: str) -> int:
    """Return the file system of a folder, 0 if it cannot be looked at."""
    try:
        return os.stat(folder).st_dev  # noqa: PTH116 (as os.walk has it)
    except (OSError, ValueError):
        return 0


def _is_searched(folder: str, device: int) -> bool:
    """Return whether a folder is on this file system and holds files of people."""
    return os.path.realpath(folder) not in _OF_KERNEL and _device(folder) == device


def is_robot(file: str) -> bool:
    """Return whether it is one, or cannot be read: its own lint says why."""
    from tfcompose.foundation.findings import RejectedError
    from tfcompose.foundation.reading import read_bytes

    try:
        return bool(_ROBOT.search(read_bytes(file)))
    except RejectedError as error:  # what is larger than a robot may be is none
        return all(found.code == "TF001" for found in error.findings)


def _print(cases: dict[str, list[Finding]], arguments: Namespace, files: int) -> None:
    """Print the findings of each file; beside a difference, to stderr."""
    form, found = arguments.format, [one for case in cases.values() for one in case]
    if form == "text":
        from tfcompose.compiler.render.text import summary

        stream = sys.stderr if arguments.diff else sys.stdout
        print_findings(found, stream)
        stream.write(summary(found, files, warnings_fail=arguments.fail_on == "warning"))
    elif form == "json":
        from tfcompose.compiler.render.formats import render_json

        sys.stdout.write(render_json(found))
    elif form == "github":
        from tfcompose.compiler.render.formats import render_github

        sys.stdout.write(render_github(found))
    elif form == "junit":
        from tfcompose.compiler.render.formats import render_junit

        rows = [("lint", file, tuple(case)) for file, case in cases.items()]
        sys.stdout.write(render_junit("tfcompose", rows, failing=_failing(arguments), seconds=0.0))
    else:
        from tfcompose.compiler.render.formats import render_sarif

        sys.stdout.write(render_sarif(found, __version__))


class _Files(NamedTuple):
    """Files that a robot file may read, and the variables that its arguments may."""

    read: Callable[[str], str]
    presets: Library
    #: Of the file, with what it includes.
    disk_of: Callable[[Source], Disk]
    environment_of: Callable[[Source], Mapping[str, str]]


def _files_of(
    file: str, presets: Library, arguments: Namespace, read: Callable[[str], str]
) -> _Files:
    """Return all files of this machine; with --untrusted those of the robot's tree."""
    if not arguments.untrusted:
        from tfcompose.cli.compiling import disk

        files = disk(trusts_files=arguments.trust, sources=[file])
        return _Files(read, presets, lambda _: files, lambda _: os.environ)
    from tfcompose.cli.untrusted import UntrustedFiles, declared_environment

    untrusted = UntrustedFiles(file, read)
    for overlay in arguments.overlays:
        untrusted.reach.add_tree(overlay)
    return _Files(
        untrusted.read,
        untrusted.library(),
        untrusted.disk_for,
        lambda source: declared_environment(source, arguments.environment),
    )


def lint_file(
    file: str, presets: Library, arguments: Namespace, read: Callable[[str], str]
) -> list[Finding]:
    """Return the findings of one file.

    Alone and with each of its profiles, or with what is asked for only.

    Alone it is judged in each combination of its arguments' values.
    """
    from dataclasses import replace

    from tfcompose.cli.compiling import given_by, overlays_of
    from tfcompose.compiler.check import unused_allows
    from tfcompose.compiler.compile import compile_source
    from tfcompose.foundation.findings import Note, RejectedError
    from tfcompose.spec.language import profiles_in, with_includes
    from tfcompose.spec.load import load

    files = _files_of(file, presets, arguments, read)
    try:
        source = with_includes(load(files.read(file), file), files.read)
        overlays = overlays_of(arguments, files.read)
    except RejectedError as error:
        return list(error.findings)
    profiles, given = arguments.profiles, given_by(arguments)
    given = replace(given, environment=files.environment_of(source))
    if not arguments.is_one:  # an argument is one of any of the files
        declared = source.data.get("args")
        names = given.args.keys() & (declared if isinstance(declared, dict) else {}).keys()
        given = replace(given, args={name: given.args[name] for name in names})

    disk = files.disk_of(source)

    def compiled(given: Given, names: Sequence[str]) -> Compiled:
        return compile_source(source, files.presets, names, overlays, files.read, disk, given)

    found, judged = _judged(source, arguments, overlays, given, compiled)
    if profiles or overlays:
        return sorted(found, key=lambda one: one.sort_key)
    used = {pair for one in judged for pair in one.used}
    complete = all(one.robot is not None for one in judged)
    for profile, inside in profiles_in(source).items():
        if "when" in inside and "args" in source.data:
            continue  # it is laid over where its condition holds
        note = Note(f"with --profile {profile}")
        known = {(one.code, one.message, one.span) for one in found}
        variant = compiled(given, [profile])
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


def _judged(
    source: Source,
    arguments: Namespace,
    overlays: Sequence[Source],
    given: Given,
    compiled: Callable[[Given, Sequence[str]], Compiled],
) -> tuple[list[Finding], list[Compiled]]:
    """Return the findings for each combination of argument values, and what was compiled."""
    if "args" not in source.data and not overlays:
        alone = compiled(given, arguments.profiles)
        return list(alone.found), [alone]
    from dataclasses import replace

    from tfcompose.cli.combinations import combinations, merged
    from tfcompose.foundation.findings import RejectedError, Span
    from tfcompose.spec.language import GivenArg, alternatives_of, composed

    try:
        alternatives, first = alternatives_of(
            composed(source, arguments.profiles, overlays, given), given, source
        )
    except RejectedError as error:
        return list(error.findings), []
    judged = []
    begin = time.monotonic()
    every = combinations(alternatives, first)
    for index, one in enumerate(every):
        if time.monotonic() - begin > JUDGE_FOR_S:
            warn(
                f"{source.file}: judged in {index} of {len(every)} combinations of its args,"
                f" within {JUDGE_FOR_S:g} s"
            )
            break
        args = {name: GivenArg(value, Span(f"{name}:={value}")) for name, value in one.items()}
        judged.append(
            (one, compiled(replace(given, args={**given.args, **args}), arguments.profiles))
        )
    return merged([(one, case.found) for one, case in judged]), [case for _, case in judged]
