"""Write a robot file from URDF, launch files, scripts or a running robot.

Write a robot file from URDF, xacro, launch files, shell scripts, Clearpath's robot.yaml,
Autoware's calibrations, a running tree or a recording. From a URDF, write links, joints and
frames, and a sensor for frames that match a preset; building the robot file gives the same URDF.
From launch files and scripts, write processes and frames. From a tree, write frames with their
owners. For anything that a robot file cannot express, write a TODO comment with its file and line,
and report a finding.
"""

from __future__ import annotations

import posixpath
import re
import sys
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.cli.options import (
    add_bag,
    add_for,
    add_trust,
    namespace,
    pairs,
    settle_duration,
)
from tfcompose.cli.terminal import FAILED, UNREADABLE, fail, print_findings, reject

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace
    from collections.abc import Iterable

    from tfcompose.compiler.compile import Compiled
    from tfcompose.compiler.urdf.lint import Document
    from tfcompose.compiler.urdf.packages import Disk, Packages
    from tfcompose.foundation.findings import Finding
    from tfcompose.model.files import Target
    from tfcompose.spec.load import Source
    from tfcompose.tools.importers.draft import ImportDraft

_LAUNCH = (".py", ".xml", ".launch", ".yaml", ".yml")
_ENDINGS = frozenset({".urdf", ".xacro", ".sh", ".bash", ".txt", "", *_LAUNCH})
_ROBOT = re.compile(r"[a-z][a-z0-9_]*")


def arguments(parser: ArgumentParser) -> None:
    """Add the arguments of ``import``."""
    parser.add_argument(
        "file",
        nargs="?",
        metavar="FILE",
        help="URDF, xacro, a launch file, a shell script, Clearpath's robot.yaml, a calibration "
        "file of Autoware, or its folder individual_params; -: a script or a launch file "
        "from stdin",
    )
    parser.add_argument(
        "more", nargs="*", metavar="FILE", help="more calibration files of Autoware"
    )
    parser.add_argument(
        "arg_values",
        nargs="*",
        default=[],
        metavar="NAME:=VALUE",
        help=(
            "an argument of the xacro or launch file; for individual_params: vehicle_id and "
            "sensor_model"
        ),
    )
    parser.add_argument("--live", action="store_true", help="import the running tree")
    add_bag(parser, "import a recording")
    add_for(parser, "with --live, observe for S seconds; default: 10")
    parser.add_argument(
        "--namespace",
        type=namespace,
        default="",
        help="the namespace of the topics tf and tf_static",
    )
    parser.add_argument(
        "-o", "--output", metavar="FILE", help="write the robot file here; default: print it"
    )
    parser.add_argument("--force", action="store_true", help="overwrite an existing file")
    parser.add_argument("--robot", metavar="NAME", help="the robot's name; default: the source's")
    parser.add_argument(
        "--package",
        action="append",
        default=[],
        metavar="NAME=FOLDER",
        dest="packages",
        help="folder of a package that is not installed; repeatable",
    )
    parser.add_argument(
        "--no-sensors", action="store_true", help="keep all frames; do not match presets"
    )
    parser.add_argument(
        "--all-branches",
        action="store_true",
        help="for a launch file: import actions whose condition is false too",
    )
    parser.add_argument(
        "--keep-going",
        action="store_true",
        help="import as much as possible from a source with errors",
    )
    add_trust(parser)


def run(arguments: Namespace) -> int:
    """Import; exit code 0, 1 for errors in the source, 2 for wrong use or an unreadable source."""
    from tfcompose.cli.reading import quote
    from tfcompose.foundation.findings import RejectedError

    check_use(arguments)
    quote(arguments.file)
    try:
        if arguments.live or arguments.bag:
            return _import_observed(arguments)
        if arguments.file.endswith((".urdf", ".xacro")):
            return _import_urdf(arguments)
        return _import_bringup(arguments)
    except RejectedError as error:
        reject(error.findings)


def _import_urdf(arguments: Namespace) -> int:
    from dataclasses import replace

    from tfcompose.compiler.urdf.lint import read_urdf

    _refuse_more(arguments)
    packages = pairs(arguments.packages, "=")
    folders = _known_packages(packages, arguments)
    document = read_urdf(arguments.file, folders, arguments.arg_values)
    errors = [finding for finding in document.findings() if finding.severity == "error"]
    print_findings(errors, sys.stderr)
    if errors and not arguments.keep_going:
        fail("nothing was written; --keep-going writes as much as possible")
    text, more_errors = _robot_file(document, arguments, folders.local | packages)
    if more_errors and not arguments.keep_going:
        print_findings(
            [replace(finding, span=None) for finding in more_errors], sys.stderr
        )  # their spans are in a file that is not written
        fail(
            "nothing was written: a robot file cannot express all of the source; --keep-going"
            " writes it anyway"
        )
    _write(text, arguments.output)
    return FAILED if errors or more_errors else 0


def _import_bringup(arguments: Namespace) -> int:
    """Import launch files and scripts.

    Write all parts that can be translated, and name all others.
    """
    from tempfile import TemporaryDirectory

    from tfcompose.cli.reading import STDIN, read_text
    from tfcompose.foundation.reading import is_folder
    from tfcompose.tools.importers.draft import ImportDraft, robot_name
    from tfcompose.tools.importers.shell import add_script

    name = "stdin" if arguments.file == STDIN else posixpath.basename(arguments.file)
    robot = arguments.robot or robot_name(name.partition(".")[0] if name != "stdin" else "robot")
    draft = ImportDraft(robot, [f"imported from {name} by tfcompose"])
    if is_folder(arguments.file):
        _add_vehicles(draft, arguments)
    elif kit := _kit(arguments.file):
        _add_kits(draft, kit, arguments)
    elif arguments.file.endswith(_LAUNCH):
        add_launch_file(draft, arguments, arguments.file)
    elif arguments.file == STDIN and (ending := _ending_of(text := _with_root(read_text(STDIN)))):
        with TemporaryDirectory() as folder:  # contains no other file to read
            file = Path(folder, f"stdin{ending}")
            file.write_text(text, encoding="utf-8")
            add_launch_file(draft, arguments, str(file), "<stdin>")
    else:
        _refuse_more(arguments)
        _refuse_given(arguments)
        source_name = arguments.file if arguments.file != STDIN else "<stdin>"
        add_script(draft, read_text(arguments.file), source_name, _target(arguments))
    return finish(draft, arguments)


def _refuse_more(arguments: Namespace) -> None:
    if arguments.more:
        fail(
            f"{arguments.more[0]} is not NAME:=VALUE, and only calibrations can be many files",
            UNREADABLE,
        )


def _refuse_given(arguments: Namespace) -> None:
    if arguments.arg_values:
        fail(
            f"{next(iter(arguments.arg_values))}:=…: only xacro and launch files take arguments",
            UNREADABLE,
        )


def _kit(file: str) -> Source | None:
    """Return the file if it is YAML but not a launch file, or None."""
    from tfcompose.cli.reading import read_text
    from tfcompose.spec.load import load

    source = load(read_text(file), file) if file.endswith((".yaml", ".yml")) else None
    return source if source and "launch" not in source.data else None


def _add_kits(draft: ImportDraft, first: Source, arguments: Namespace) -> None:
    from tfcompose.cli.reading import read_text
    from tfcompose.spec.load import load
    from tfcompose.tools.importers.kits import add_kit

    _refuse_given(arguments)
    target = _target(arguments)
    for package, folder in pairs(arguments.packages, "=").items():
        draft.sections["packages"][package] = target.from_folder(folder)
    for source in (first, *(load(read_text(file), file) for file in arguments.more)):
        add_kit(draft, source)


def _add_vehicles(draft: ImportDraft, arguments: Namespace) -> None:
    from tfcompose.cli.reading import read_text
    from tfcompose.spec.load import load
    from tfcompose.tools.importers.kits import add_vehicles

    _refuse_more(arguments)
    for name in arguments.arg_values.keys() - {"vehicle_id", "sensor_model"}:
        fail(
            f"{name}:=…: a folder of Autoware's individual_params takes vehicle_id and"
            " sensor_model",
            UNREADABLE,
        )
    folder = Path(arguments.file)
    add_vehicles(
        draft,
        folder,
        _target(arguments),
        arguments.arg_values,
        lambda file: load(read_text(file), file),
    )


def _import_observed(arguments: Namespace) -> int:
    return finish(observed_draft(arguments), arguments)


def observed_draft(arguments: Namespace, *, is_adopted: bool = False) -> ImportDraft:
    """Return a draft of the published or recorded tree.

    With ``is_adopted``, fixed edges of stock nodes stay with those nodes.
    """
    from tfcompose.cli.compiling import library
    from tfcompose.cli.live import observe_topics
    from tfcompose.model.plan.topics import topics_below
    from tfcompose.tf.ros.processes import words_of
    from tfcompose.tools.importers.draft import ImportDraft, robot_name
    from tfcompose.tools.importers.observed import Observed

    topics = topics_below(arguments.namespace)
    observer = observe_topics(
        "tfcompose_import", [topics], bag=arguments.bag, duration_s=arguments.duration
    )[topics]
    if arguments.bag:
        name = Path(arguments.bag).stem
        origin = f"the recording {name}"
    else:
        name, origin = "robot", "a running robot"
    done = "adopted" if is_adopted else "imported"
    head = f"{done} from {origin} by tfcompose"
    draft = ImportDraft(arguments.robot or robot_name(name), [head], is_adopted=is_adopted)
    if arguments.namespace:
        draft.sections["ros"] |= {"namespace": arguments.namespace, "isolate": "topics"}
    tree = Observed(draft, observer.publishers.where, words_of, arguments.namespace)
    tree.add(observer.edges(observer.until_ns))
    if not arguments.no_sensors:
        tree.recognise(library())
    return draft


def _with_root(text: str) -> str:
    """Return the text as an XML launch file.

    If the text contains only elements, add ``<launch>`` around them, without moving a line.
    """
    return (
        f"<launch>{text}</launch>"
        if re.match(r"\s*<(node|include|arg|group|param|remap)\b", text)
        else text
    )


def _ending_of(text: str) -> str:
    """Return the file ending of a launch file with this text; empty if it is not a launch file."""
    if "def generate_launch_description" in text:
        return ".py"
    return (
        ".xml"
        if re.search(r"^\s*<launch\b", text, re.MULTILINE)
        else ".yaml"
        if re.search(r"^launch:", text, re.MULTILINE)
        else ""
    )


def add_launch_file(draft: ImportDraft, arguments: Namespace, file: str, name: str = "") -> None:
    """Add the processes of a launch file, and the descriptions of its state publishers."""
    from tfcompose.cli.compiling import library, print_output, report_missing_confinement
    from tfcompose.cli.reading import read_text
    from tfcompose.tools.importers.launch import add_launch
    from tfcompose.tools.importers.launch_answer import Launch
    from tfcompose.tools.importers.urdf import ImportContext, add_descriptions

    _refuse_more(arguments)
    packages = pairs(arguments.packages, "=")
    package_folders, target = _known_packages(packages, arguments), _target(arguments)
    prefixes = package_folders.disk.prefixes if package_folders.disk else ()
    launch = Launch(
        file,
        read_text(file),
        arguments.arg_values,
        packages,
        prefixes=prefixes,
        every_branch=arguments.all_branches,
        display_name=name,
        is_trusted=arguments.trust,
        print_output=print_output,
        report_missing=report_missing_confinement,
    )
    folders = {name: str(Path(folder).absolute()) for name, folder in packages.items()}
    descriptions = add_launch(draft, launch, target)
    presets = None if arguments.no_sensors else library()
    add_descriptions(draft, descriptions, ImportContext(package_folders, target, presets, folders))


def finish(draft: ImportDraft, arguments: Namespace) -> int:
    """Write a draft, with lint's findings about it; return the exit code.

    Raises:
        SystemExit: if nothing was written.
    """
    from dataclasses import replace

    from tfcompose.tools.importers.draft import text_with_findings

    if draft.is_empty():
        print_findings(draft.findings, sys.stderr)
        fail("nothing was written: a robot file can express nothing of the source")
    folder = posixpath.dirname(arguments.output or "")
    neighbours = {posixpath.join(folder, path): text for path, text in draft.neighbours.items()}
    _write_neighbours(neighbours, arguments)
    text, compiled = text_with_findings(draft, lambda text: _lint(text, arguments))
    _write(text, arguments.output)
    print_findings(draft.findings, sys.stderr)
    findings = (
        compiled.findings
        if arguments.output
        else [replace(finding, span=None, notes=()) for finding in compiled.findings]
    )
    print_findings(list(dict.fromkeys(findings)), sys.stderr)
    return FAILED if compiled.errors else 0


def _write_neighbours(files: dict[str, str], arguments: Namespace) -> None:
    """Write files of the launch file that the robot file names next to the robot file."""
    from tfcompose.foundation.findings import finding
    from tfcompose.foundation.reading import exists

    if not arguments.output:
        message = "{}, which the robot file names, is only written together with a robot file"
        advice = "import … -o FILE writes both"
        findings = [finding("TF020", message.format(path), None, help=advice) for path in files]
        print_findings(findings, sys.stderr)
        return
    for path in files:
        if exists(path) and not arguments.force:
            fail(f"{path} exists already; --force overwrites it", UNREADABLE)
    for path, text in files.items():
        with suppress(OSError):  # the write below reports the error
            Path(path).parent.mkdir(exist_ok=True)
        _write(text, path)


def _disk(packages: Iterable[str], arguments: Namespace) -> Disk:
    """Return the files that xacro may read: files of the source and of these packages."""
    from tfcompose.cli.compiling import disk

    sources = [arguments.file] if arguments.file else []
    return disk(trusts_files=arguments.trust, sources=sources, folders=list(packages))


def _known_packages(packages: dict[str, str], arguments: Namespace) -> Packages:
    from tfcompose.compiler.urdf.packages import Packages
    from tfcompose.foundation.findings import Span

    named = {
        name: (str(Path(folder).absolute()), Span(folder)) for name, folder in packages.items()
    }
    advice = "--package {name}=FOLDER, or source the workspace's setup file"
    return Packages(_disk(packages.values(), arguments), named, advice=advice)


def check_use(arguments: Namespace) -> None:
    """Refuse invalid names, and an output file that exists.

    Raises:
        SystemExit: after printing the reason.
    """
    if bool(arguments.file) + arguments.live + bool(arguments.bag) != 1:
        fail("name one source: a file, --live or --bag", UNREADABLE)
    settle_duration(arguments, 10.0, is_live=arguments.live)
    if not arguments.file:
        _refuse_given(arguments)
    if arguments.file and Path(arguments.file).suffix not in _ENDINGS:
        fail(
            f"{arguments.file}: only URDF, xacro, launch and YAML files and shell scripts can be"
            " imported",
            UNREADABLE,
        )
    if arguments.robot and not _ROBOT.fullmatch(arguments.robot):
        fail(
            f"--robot {arguments.robot}: use lower case letters, digits and _, beginning with a"
            " letter",
            UNREADABLE,
        )
    from tfcompose.foundation.reading import exists

    if arguments.output and exists(arguments.output) and not arguments.force:
        fail(f"{arguments.output} exists already; --force overwrites it", UNREADABLE)


def _target(arguments: Namespace) -> Target:
    from tfcompose.model.files import Target

    return Target(
        "as-written", posixpath.dirname(arguments.output or "") or ".", Path.cwd().as_posix()
    )


def _lint(text: str, arguments: Namespace) -> Compiled:
    from tfcompose.cli.compiling import library
    from tfcompose.cli.reading import read_text
    from tfcompose.compiler.compile import compile_robot

    files = _disk(pairs(arguments.packages, "=").values(), arguments)
    return compile_robot(
        text,
        arguments.output or "robot.yaml",
        library(),
        read=read_text,
        disk=files,
    )


def _robot_file(
    document: Document, arguments: Namespace, packages: dict[str, str]
) -> tuple[str, list[Finding]]:
    """Return the robot file, and errors in it that are not errors of the source."""
    from tfcompose.cli.compiling import library
    from tfcompose.tools.importers.robot_file import import_document, with_findings

    presets = None if arguments.no_sensors else library()
    robot = import_document(document, _target(arguments), arguments.robot or "", packages, presets)
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
