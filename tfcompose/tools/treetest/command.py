"""Check a robot, started or recorded, against the expectations in a test file.

Run the cases of FILE, or of all files below a folder that end in .test.yaml. Each case starts the
robot in a ROS domain of its own, or replays a recording, and compares the tree with what the case
expects: completeness, rates, ages, poses, lookups and findings. A failed expectation is printed at
its line, with what was observed and when. Exit 0 if all cases pass; 1 if one fails, also because
its recording has no TF; 2 if a test file or a robot file is wrong, or a recording cannot be
opened: then no case runs.
"""

from __future__ import annotations

import json
import os
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.cli.options import add_format, add_trust, positive_count
from tfcompose.cli.terminal import (
    INTERRUPTED,
    UNREADABLE,
    fail,
    print_findings,
    printable,
    reject,
)

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace

    from tfcompose.foundation.findings import Finding
    from tfcompose.foundation.signals import Stop
    from tfcompose.tools.treetest.case import Case
    from tfcompose.tools.treetest.judging import CaseResult

FAILING = frozenset({"error"})


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument(
        "files",
        nargs="*",
        default=[],
        metavar="FILE|FOLDER",
        help="test files, or folders with files *.test.yaml; default: this folder",
    )
    parser.add_argument(
        "-k", dest="text", metavar="TEXT", help="run only cases whose name contains TEXT"
    )
    parser.add_argument(
        "-j",
        "--jobs",
        type=positive_count,
        default=1,
        metavar="N",
        help="run up to N cases at the same time; default: 1",
    )
    parser.add_argument(
        "--keep",
        metavar="FOLDER",
        help=(
            "leave a folder of each failed case in FOLDER: a bag of its TF, a picture of the tree,"
            " and the logs of a started robot"
        ),
    )
    add_format(parser, "json", "github")
    parser.add_argument("--junit", metavar="FILE", help="write the results as JUnit's XML to FILE")
    add_trust(parser)


def run(arguments: Namespace) -> int:
    """Run the cases; exit code 0, 1 if one fails, 2 if something cannot be read."""
    from tfcompose.foundation.signals import Stop

    cases = _cases(arguments)
    keep = _folder_to_keep(arguments.keep)
    begun = time.monotonic()
    with Stop() as stop:
        results = _run(cases, arguments, keep, stop)
        if stop.requested:
            return INTERRUPTED
    if arguments.junit:
        _write_junit(arguments.junit, results, time.monotonic() - begun)
    _report(results, arguments.format)
    return int(any(result.findings for result in results))


def _cases(arguments: Namespace) -> list[Case]:
    """Return the requested cases.

    Raises:
        SystemExit: after reporting all that is wrong with the files, or that no case is there.
    """
    from tfcompose.foundation.findings import RejectedError
    from tfcompose.tools.treetest.cases import CaseLoader, files_in

    names = arguments.files or ["."]
    files = list(
        dict.fromkeys(os.path.normpath(file) for name in names for file in files_in(name))
    )
    if not files:
        fail(f"no file below {' or '.join(names)} ends in .test.yaml", UNREADABLE)
    loader = CaseLoader(trust=arguments.trust)
    cases: list[Case] = []
    findings: list[Finding] = []
    for file in files:
        try:
            cases += loader.load(file)
        except RejectedError as error:
            findings += error.findings
    if findings:
        reject(list(dict.fromkeys(findings)), UNREADABLE)
    text = (arguments.text or "").lower()
    selected = [case for case in cases if text in case.spec.name.lower()]
    if not selected:
        fail(f"no case has {arguments.text!r} in its name", UNREADABLE)
    return selected


def _folder_to_keep(name: str | None) -> Path | None:
    """Return the folder for what failed cases leave, which exists then; None without a name.

    Raises:
        SystemExit: after reporting that it cannot be made, or that no bag can be written.
    """
    from tfcompose.cli.live import no_rosbags

    if name is None:
        return None
    if missing := no_rosbags():
        reject([missing], UNREADABLE)
    folder = Path(name)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        fail(f"{name} cannot be made: {error.strerror}", UNREADABLE)
    return folder


def _run(
    cases: list[Case], arguments: Namespace, keep: Path | None, stop: Stop
) -> list[CaseResult]:
    """Run the cases, and print each result as text, in order; until a signal comes."""
    from concurrent.futures import ThreadPoolExecutor

    from tfcompose.tools.treetest.running import run_case

    results: list[CaseResult] = []
    with ThreadPoolExecutor(arguments.jobs) as executor:
        futures = [executor.submit(run_case, case, stop, keep) for case in cases]
        try:
            for future in futures:
                result = future.result()
                if stop.requested:
                    break
                results.append(result)
                if arguments.format == "text":
                    _print(result)
        except OSError as error:
            where = f"{error.filename}: " if error.filename else ""
            fail(f"{where}a case cannot run: {error.strerror}", UNREADABLE)
        finally:
            executor.shutdown(wait=False, cancel_futures=True)
    return results


def _print(result: CaseResult) -> None:
    state = "failed" if result.findings else "passed"
    print(printable(f"{state}  {result.case.file}: {result.case.spec.name}"))
    print_findings(result.findings, sys.stdout)
    if result.folder is not None:
        print(printable(f"  see {result.folder}"))
    sys.stdout.flush()


def _report(results: list[CaseResult], form: str) -> None:
    from tfcompose.compiler.render.formats import render_github, render_json
    from tfcompose.foundation.text import plural

    failed = sum(bool(result.findings) for result in results)
    if form == "text":
        print(f"{plural(len(results), 'case')}, {failed} failed")
    elif form == "github":
        sys.stdout.write(render_github([each for result in results for each in result.findings]))
    else:
        rows = [
            {
                "file": result.case.file,
                "name": result.case.spec.name,
                "line": result.case.value_span("name").line,
                "passed": not result.findings,
                "findings": json.loads(render_json(result.findings)),
            }
            for result in results
        ]
        print(json.dumps(rows, indent=2, ensure_ascii=False))


def _write_junit(file: str, results: list[CaseResult], seconds: float) -> None:
    """Write JUnit's XML.

    Raises:
        SystemExit: after reporting that the file cannot be written.
    """
    from tfcompose.compiler.render.formats import render_junit

    rows = [(result.case.file, result.case.spec.name, result.findings) for result in results]
    text = render_junit("tfcompose", rows, failing=FAILING, seconds=seconds)
    try:
        Path(file).write_text(text, "utf-8")
    except OSError as error:
        fail(f"{file} cannot be written: {error.strerror}", UNREADABLE)
