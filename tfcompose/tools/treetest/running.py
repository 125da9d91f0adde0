"""Running of a case: on its recording, or on a robot in a ROS domain of its own."""

from __future__ import annotations

import os
import pickle
import re
import shutil
import signal
import subprocess
import sys
import tempfile
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.foundation.findings import Note, finding
from tfcompose.launcher.program import without_current_folder
from tfcompose.tf.ros.domains import DOMAINS, reserve_domain
from tfcompose.tf.ros.environment import DOMAIN, RANGE, RosError, no_ros
from tfcompose.tools.treetest.judging import CaseResult, judge_recording

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.foundation.findings import Finding
    from tfcompose.foundation.signals import Stop
    from tfcompose.tools.treetest.cases import Case

#: How often the end of a case's process is checked, in seconds.
_CHECK_EVERY_S = 0.05
#: Time for a case's process to end its robot, in seconds; longer than ``up`` takes to kill it.
_END_S = 60.0
#: Variables that lead discovery beyond this machine, whatever its range.
_REACHING_OUT = ("ROS_STATIC_PEERS", "ROS_DISCOVERY_SERVER", "ROS_LOCALHOST_ONLY")
#: Maximum number of printed lines of a process that failed.
_LINES = 10


@dataclass(frozen=True, slots=True)
class LiveSetup:
    """What a case's process is given."""

    #: Its plan has the reserved ROS domain.
    case: Case
    #: Settings with which ``up`` gets that domain from the robot file.
    settings: tuple[str, ...]
    #: For its files and those of the robot.
    folder: Path
    #: The process that it ends with.
    parent: int
    #: Whether to leave files for inspection there.
    keeps: bool

    @property
    def file(self) -> Path:
        """The file with this, pickled."""
        return self.folder / "setup"

    @property
    def result(self) -> Path:
        """The file with the pickled findings."""
        return self.folder / "result"

    @property
    def errors(self) -> Path:
        """The file with what the process prints."""
        return self.folder / "judge.log"


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


@contextmanager
def _folder_of(case: Case, keep: Path | None) -> Iterator[Path]:
    """Give a new folder for a case's files, and remove it if the block fails."""
    if keep is None:
        folder = Path(tempfile.mkdtemp(prefix="tfcompose-test-"))
    else:
        folder = keep / re.sub(r"\W+", "_", f"{case.file} {case.spec.name}").strip("_")
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
        setup = _setup_of(case, domain, folder, keeps=keeps)
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
    findings: list[Finding] = pickle.loads(setup.result.read_bytes())  # noqa: S301 (of our own process)
    for path in (setup.file, setup.result, setup.errors):
        path.unlink()
    return findings


def _setup_of(case: Case, domain: int, folder: Path, *, keeps: bool) -> LiveSetup:
    """Return the setup of a case in a domain, whatever its robot file sets."""
    file_ros = case.plan.ros
    settings: list[str] = []
    if file_ros.domain_id is not None:
        settings.append(f"ros.domain_id={domain}")
    if file_ros.discovery not in {None, "localhost"}:
        settings.append("ros.discovery=localhost")
    ros = replace(file_ros, domain_id=domain, discovery="localhost")
    case = replace(case, plan=replace(case.plan, ros=ros))
    return LiveSetup(case, tuple(settings), folder, os.getpid(), keeps=keeps)


def _run_process(setup: LiveSetup, env: dict[str, str], stop: Stop) -> int:
    """Run a case's process, or end it if ``stop`` is requested, and return its exit code."""
    setup.file.write_bytes(pickle.dumps(setup))
    with setup.errors.open("wb") as errors:
        process = subprocess.Popen(
            [*own_command("tfcompose.tools.treetest.live_case"), str(setup.file)],
            stdin=subprocess.DEVNULL,
            stdout=errors,
            stderr=errors,
            env=without_current_folder(env),
            start_new_session=True,
        )
    while process.poll() is None and not stop.wait(_CHECK_EVERY_S):
        pass
    return end_process(process, signal.SIGTERM, _END_S)


def end_process(process: subprocess.Popen[bytes], number: int, timeout_s: float) -> int:
    """End a process by a signal if it runs, or kill it after a time; return its exit code."""
    if process.poll() is None:
        process.send_signal(number)
    try:
        return process.wait(timeout_s)
    except subprocess.TimeoutExpired:
        process.kill()
        return process.wait()


def own_command(module: str) -> list[str]:
    """Return the command that runs a module's ``main``, and imports nothing from this folder."""
    package = str(Path(__file__).absolute().parents[3])
    path = f"sys.path[:] = [*filter(None, sys.path), {package!r}]"
    code = f"import sys; {path}; from {module} import main; sys.exit(main())"
    return [sys.executable, "-c", code]


def not_judged(case: Case, reason: str, *lines: str) -> Finding:
    """Return the finding for a case without a verdict, with lines that a process printed."""
    return finding(
        "TF932", reason, case.value_span("name"), notes=[Note(line) for line in lines if line]
    )
