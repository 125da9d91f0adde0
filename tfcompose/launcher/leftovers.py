"""Processes that a run left behind, and descendants of a launcher.

Leftovers have the run id in their environment. Both kinds are found even if they left their
process group and session. Leftovers are found even if the launcher was killed.
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

#: The kernel ends a killed process within this time, in seconds, even under high load.
KILLED_WITHIN_S = 5.0


def descendants(ancestor: int, but: int) -> dict[int, int]:
    """Return the process group of each descendant of ``ancestor``, by pid.

    The process ``but`` and its descendants are left out.
    """
    running: dict[int, procfs.Stat] = {}
    for pid in procfs.pids():
        with contextlib.suppress(OSError):
            stat = procfs.stat(pid)
            if stat.state != "Z":
                running[pid] = stat
    depths: dict[int, int] = {}
    for pid, stat in running.items():
        above = pid
        while above not in {ancestor, but} and above in running:
            above = running[above].parent
        if above == ancestor and pid != ancestor:
            depths[pid] = stat.group
    return depths


@dataclass(frozen=True, slots=True)
class Leftover:
    """A process that a run started."""

    pid: int
    #: The run's id.
    run: str
    command: str
    #: Start time in clock ticks since boot.
    began: int
    #: The launcher's process id while the launcher runs. Then the process is not left behind.
    launcher: int | None = None
    #: The process of the plan that started it; empty if unknown.
    process: str = ""


def launcher_mark() -> str:
    """Return the mark by which processes of a run identify this process as their launcher."""
    return f"{os.getpid()}:{procfs.stat('self').began}"


def leftovers(run: str) -> list[Leftover]:
    """Return the processes whose run id is or begins with ``run``.

    For example, "rover@0:" matches all runs of rover.
    """
    remaining = []
    for pid in procfs.pids():
        with contextlib.suppress(OSError):
            if pid != os.getpid() and (leftover := _leftover_of(pid, run)):
                remaining.append(leftover)
    return remaining


def leftovers_of(pids: Iterable[int], run: str) -> list[Leftover]:
    """Return the running processes among ``pids``, as leftovers of this run."""
    remaining = []
    for pid in pids:
        with contextlib.suppress(OSError):
            remaining.append(Leftover(pid, run, _command(pid), procfs.stat(pid).began))
    return remaining


def signal_leftovers(run: str, processes: Collection[str], number: signal.Signals) -> None:
    """Signal the leftovers in this run of the given processes, which have ended."""
    for leftover in leftovers(run):
        if leftover.process in processes:
            _send(leftover, number)


def end(processes: list[Leftover], patience_s: float = 2.0) -> list[Leftover]:
    """Terminate leftovers, and kill those alive after ``patience_s`` seconds.

    Return the processes that survive both.
    """
    for number, wait_s in ((signal.SIGTERM, patience_s), (signal.SIGKILL, KILLED_WITHIN_S)):
        for leftover in processes:
            _send(leftover, number)
        until = time.monotonic() + wait_s
        while (
            processes := [leftover for leftover in processes if _is_there(leftover)]
        ) and time.monotonic() < until:
            time.sleep(0.02)
        if not processes:
            break
    return processes


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
    """Return the launcher's process id if it still runs in this network namespace."""
    number, _, since = mark.partition(":")
    with contextlib.suppress(OSError, ValueError):
        pid = int(number)
        same = procfs.network(pid) == procfs.network("self")
        return pid if same and procfs.stat(pid).began == int(since) else None
    return None


def _send(leftover: Leftover, number: int) -> None:
    """Send the signal to exactly this process, not to a later process with the same id."""
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
