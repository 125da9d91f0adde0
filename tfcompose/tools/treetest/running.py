"""Running of a case: on its recording, or on a robot in a ROS domain of its own."""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import signal
import subprocess
import tempfile
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.foundation.findings import Note, finding
from tfcompose.launcher.program import without_current_folder
from tfcompose.tf.ros.domains import DOMAINS, reserve_domain
from tfcompose.tf.ros.environment import DOMAIN, RANGE, RosError, no_ros
from tfcompose.tools.treetest.judging import CaseResult, judge_recording
from tfcompose.tools.treetest.processes import end_process, own_command
from tfcompose.tools.treetest.setup import LiveSetup

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.foundation.findings import Finding
    from tfcompose.foundation.signals import Stop
    from tfcompose.tools.treetest.case import Case

#: How often the end of a case's process is checked, in seconds.
_CHECK_EVERY_S = 0.05
#: Time for a case's process to end its robot, in seconds; longer than ``up`` takes to kill it.
_END_S = 60.0
#: Variables that lead discovery beyond this machine, whatever its range.
_REACHING_OUT = ("ROS_STATIC_PEERS", "ROS_DISCOVERY_SERVER", "ROS_LOCALHOST_ONLY")
#: Maximum number of printed lines of a process that failed.
_LINES = 10
#: Maximum number of characters of a case in the name of its folder; each may have four bytes.
_MOST_CHARS = 50


def run_case(case: Case, stop: Stop, keep: Path | None = None) -> CaseResult:
    """Run a case and return its result; without findings if ``stop`` is requested.

    A case without a recording starts its robot, and ends it. With ``keep``, a failed case leaves
    a folder there, with a bag and a picture of its tree, and the logs of a started robot.

    Raises:
        OSError: if files cannot be written.
    """
    with _folder_of(case, keep) as folder:
        if case.bag is not None:
            findings = judge_recording(case, case.bag, stop, folder if keep else None)
        elif missing := no_ros():
            findings = [replace(missing, span=case.value_span("name"))]
        else:
            findings = _run_live(case, folder, stop, keeps=keep is not None)
        is_kept = keep is not None and bool(findings)
        if not is_kept:
            shutil.rmtree(folder, ignore_errors=True)
    return CaseResult(case, tuple(findings), folder if is_kept else None)


def name_of_folder(file: str, name: str) -> str:
    """Return the name of the folder that a failed case leaves: short, and of this case alone."""
    words = re.sub(r"\W+", "_", f"{Path(file).name.removesuffix('.yaml')} {name}").strip("_")
    digest = hashlib.sha256(f"{file}\n{name}".encode("utf-8", "surrogateescape")).hexdigest()
    return f"{words[:_MOST_CHARS]}_{digest[:8]}"


@contextmanager
def _folder_of(case: Case, keep: Path | None) -> Iterator[Path]:
    """Give a new folder for a case's files, and remove it if the block fails."""
    if keep is None:
        folder = Path(tempfile.mkdtemp(prefix="tfcompose-test-"))
    else:
        folder = keep / name_of_folder(case.file, case.spec.name)
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(mode=0o700, parents=True)
    try:
        yield folder
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise


def _run_live(case: Case, folder: Path, stop: Stop, *, keeps: bool) -> list[Finding]:
    """Start a case's process in a free domain, wait for its end, and return its findings."""
    first = os.getpid() % len(DOMAINS)
    with ExitStack() as stack:
        try:
            domains = [*DOMAINS[first:], *DOMAINS[:first]]
            domain = stack.enter_context(reserve_domain(domains))
        except RosError as error:
            return [not_judged(case, str(error))]
        runtime = stack.enter_context(tempfile.TemporaryDirectory(prefix="tfcompose-test-"))
        setup = LiveSetup.of(_in_domain(case, domain), folder, os.getpid(), keeps=keeps)
        env = {name: value for name, value in os.environ.items() if name not in _REACHING_OUT}
        env |= {
            DOMAIN: str(domain),
            RANGE: "LOCALHOST",
            "XDG_RUNTIME_DIR": runtime,
            "ROS_LOG_DIR": str(folder / "log"),
        }
        code = _run_process(setup, env, stop)
    if stop.requested:
        return []
    if code:
        lines = setup.errors.read_text("utf-8", errors="replace").splitlines()[-_LINES:]
        return [not_judged(case, f"the process of the case ended with {code}", *lines)]
    findings = setup.read_findings()
    for path in (setup.path, setup.result, setup.errors):
        path.unlink()
    return findings


def _in_domain(case: Case, domain: int) -> Case:
    """Return the case in a ROS domain on this machine, whatever its robot file sets."""
    ros = replace(case.plan.ros, domain_id=domain, discovery="localhost")
    return replace(case, plan=replace(case.plan, ros=ros))


def _run_process(setup: LiveSetup, env: dict[str, str], stop: Stop) -> int:
    """Run a case's process, or end it if ``stop`` is requested, and return its exit code."""
    setup.write()
    with setup.errors.open("wb") as errors:
        process = subprocess.Popen(
            [*own_command("tfcompose.tools.treetest.live_case"), str(setup.path)],
            stdin=subprocess.DEVNULL,
            stdout=errors,
            stderr=errors,
            env=without_current_folder(env),
            start_new_session=True,
        )
    while process.poll() is None and not stop.wait(_CHECK_EVERY_S):
        pass
    return end_process(process, signal.SIGTERM, _END_S)


def not_judged(case: Case, reason: str, *lines: str) -> Finding:
    """Return the finding for a case without a verdict, with lines that a process printed."""
    return finding(
        "TF932", reason, case.value_span("name"), notes=[Note(line) for line in lines if line]
    )
