"""``up -d``: the launcher goes on in the background, and this command follows it until the robot is up."""

from __future__ import annotations

import contextlib
import os
import sys
import traceback
from typing import TYPE_CHECKING

from tfcompose.cli.console import Console
from tfcompose.cli.runs import complain_of_leftovers, notices, print_missing
from tfcompose.cli.terminal import FAILED, INTERRUPTED, coloured, complain
from tfcompose.ipc import AllReady, AllStarted, Ended
from tfcompose.launcher.logs import Logs
from tfcompose.launcher.supervisor import supervise

if TYPE_CHECKING:
    from argparse import Namespace

    from tfcompose.launcher.runtime_dir import Lock, RuntimeDir
    from tfcompose.launcher.supervisor import Session
    from tfcompose.plan import Plan


def detach(plan: Plan, place: RuntimeDir, lock: Lock, session: Session, arguments: Namespace) -> int:
    """Start the launcher as a process of its own; return 0 when all is started, or ready; 1 when it is not."""
    complain_of_leftovers(place, session.run_id)
    sys.stdout.flush()
    sys.stderr.flush()
    pid = os.fork()
    if pid == 0:
        code = FAILED
        try:
            lock.sign()
            code = _launch(plan, place, session, arguments.duration)
        except BaseException:  # noqa: BLE001 (nobody further out says what it was)
            traceback.print_exc()
        finally:
            sys.stderr.flush()
            os._exit(code)
    if session.listener:
        session.listener.close()
    return _follow(plan, place, pid, arguments)


def _launch(plan: Plan, place: RuntimeDir, session: Session, duration_s: float | None) -> int:
    """Run as a process without a terminal; Python's own errors go to a file next to the logs."""
    os.setsid()
    nowhere = errors = os.open(os.devnull, os.O_RDWR)
    with contextlib.suppress(OSError):  # a full disk stops no robot
        place.logs.mkdir(parents=True, exist_ok=True)
        errors = os.open(place.logs / "launcher.err", os.O_CREAT | os.O_WRONLY | os.O_TRUNC, 0o640)
    for fd, to in ((0, nowhere), (1, errors), (2, errors)):
        os.dup2(to, fd)
    for fd in {nowhere, errors}:
        os.close(fd)
    logs = Logs(place.logs)
    console = Console(plan, _Nowhere(), colour=False, keep=logs.write)
    try:
        return supervise(plan, session.plan_file, report=console, duration_s=duration_s, session=session)
    finally:
        logs.close()


class _Nowhere:
    def write(self, text: str, *, log: bool = False) -> None:
        """Do nothing: the logs have it."""


class _StandardOutput:
    def write(self, text: str, *, log: bool = False) -> None:
        """Write at once."""
        del log
        sys.stdout.write(text)
        sys.stdout.flush()


def _follow(plan: Plan, place: RuntimeDir, pid: int, arguments: Namespace) -> int:
    console = Console(plan, _StandardOutput(), colour=coloured(sys.stdout))
    goal = AllReady if arguments.wait else AllStarted
    with contextlib.suppress(OSError):
        try:
            for notice, _ in notices(place, arguments.timeout if arguments.wait else None):
                console(notice)
                if isinstance(notice, Ended):
                    return os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
                if isinstance(notice, goal):
                    print(f"{place.name} runs in the background: pid {pid}; see tfcompose ps, logs -f and down")
                    return 0
        except TimeoutError:
            print_missing(place, arguments.timeout)
            return FAILED
        except KeyboardInterrupt:
            complain(f"{place.name} keeps running in the background: pid {pid}; tfcompose down stops it")
            return INTERRUPTED
    complain(f"the launcher has ended; see {place.logs / 'launcher.err'}")
    return FAILED
