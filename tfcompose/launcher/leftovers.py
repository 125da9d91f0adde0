"""Processes that a run left behind, and a launcher's descendants.

Leftovers have the run id in their environment. Both are found even if they left their group and
session; leftovers even if the launcher was killed.
"""

from __future__ import annotations

import contextlib
import os
import signal
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

from tfcompose.foundation import procfs
from tfcompose.model.variables import LAUNCHER, PROCESS, RUN_ID

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable

#: The kernel ends a killed process within this time, in seconds, also where much is going on.
KILLED_WITHIN_S = 5.0


def descendants(ancestor: int, but: int) -> dict[int, int]:
    """Return the group of each descendant of ``ancestor``, except ``but`` and its descendants."""
    running: dict[int, procfs.Stat] = {}
    for pid in procfs.pids():
        with contextlib.suppress(OSError):
            stat = procfs.stat(pid)
            if stat.state != "Z":
                running[pid] = stat
    found: dict[int, int] = {}
    for pid, stat in running.items():
        above = pid
        while above not in {ancestor, but} and above in running:
            above = running[above].parent
        if above == ancestor and pid != ancestor:
            found[pid] = stat.group
    return found


@dataclass(frozen=True, slots=True)
class Leftover:
    """A process that a run started."""

    pid: int
    #: The run's id.
    run: str
    command: str
    #: In clock ticks since boot.
    began: int
    #: The launcher's process id while it runs; the process is not left behind then.
    launcher: int | None = None
    #: The plan's process that started it; empty if its environment does not name one.
    process: str = ""


def launcher_mark() -> str:
    """Return the mark by which a run's processes identify this process as their launcher."""
    return f"{os.getpid()}:{procfs.stat('self').began}"


def leftovers(run: str) -> list[Leftover]:
    """Return the processes whose run id is ``run`` or begins with it.

    "rover@0:" matches all runs of rover.
    """
    found = []
    for pid in procfs.pids():
        with contextlib.suppress(OSError):
            if pid != os.getpid() and (leftover := _leftover_of(pid, run)):
                found.append(leftover)
    return found


def leftovers_of(pids: Iterable[int], run: str) -> list[Leftover]:
    """Return those of these processes that run, as leftovers of this run."""
    found = []
    for pid in pids:
        with contextlib.suppress(OSError):
            found.append(Leftover(pid, run, _command(pid), procfs.stat(pid).began))
    return found


def signal_leftovers(run: str, processes: Collection[str], number: signal.Signals) -> None:
    """Signal what these processes, now ended, left behind in this run."""
    for leftover in leftovers(run):
        if leftover.process in processes:
            _send(leftover, number)


def end(found: list[Leftover], patience_s: float = 2.0) -> list[Leftover]:
    """Terminate leftovers, kill those alive after ``patience_s`` seconds; return survivors."""
    for number, wait_s in ((signal.SIGTERM, patience_s), (signal.SIGKILL, KILLED_WITHIN_S)):
        for leftover in found:
            _send(leftover, number)
        until = time.monotonic() + wait_s
        while (
            found := [leftover for leftover in found if _is_there(leftover)]
        ) and time.monotonic() < until:
            time.sleep(0.02)
        if not found:
            break
    return found


def _leftover_of(pid: int, run: str) -> Leftover | None:
    env = procfs.environ(pid)
    if RUN_ID not in env or not env[RUN_ID].startswith(run):
        return None
    return Leftover(
        pid,
        env[RUN_ID],
        _command(pid),
        began=procfs.stat(pid).began,
        launcher=_launcher(env.get(LAUNCHER, "")),
        process=env.get(PROCESS, ""),
    )


def _command(pid: int) -> str:
    return " ".join(procfs.argv(pid))[:200]


def _launcher(mark: str) -> int | None:
    """Return the launcher's process id if it still runs, in this network namespace."""
    number, _, since = mark.partition(":")
    with contextlib.suppress(OSError, ValueError):
        pid = int(number)
        same = procfs.network(pid) == procfs.network("self")
        return pid if same and procfs.stat(pid).began == int(since) else None
    return None


def _send(leftover: Leftover, number: int) -> None:
    """Send the signal to exactly that process, not to a later one with the same id."""
    with contextlib.suppress(OSError):
        descriptor = os.pidfd_open(leftover.pid)
        try:
            if _is_there(leftover):
                signal.pidfd_send_signal(descriptor, number)
        finally:
            os.close(descriptor)


def _is_there(leftover: Leftover) -> bool:
    try:
        stat = procfs.stat(leftover.pid)
    except OSError:
        return False
    return stat.began == leftover.began and stat.state != "Z"
