"""Processes that a run left behind, and a launcher's descendants.

The first have the run's id in their environment. Both are found also where they left their group
and session; the first also where the launcher was killed.
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
    """Return the group of each descendant of ``ancestor``, without ``but`` and its own."""
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
    """A process that a run started.

    Its number, its run's id, its command, and when it began (clock ticks).

    ``launcher`` is the number of the run's launcher if that one still runs: then nothing was left
    behind. ``process`` is the plan's process that started it, as far as its environment names one.
    """

    pid: int
    run: str
    command: str
    began: int
    launcher: int | None = None
    process: str = ""


def launcher_mark() -> str:
    """Return how a process of a run knows its launcher, which is this process."""
    return f"{os.getpid()}:{procfs.stat('self').began}"


def leftovers(run: str) -> list[Leftover]:
    """Return the processes whose run's id is, or begins with, ``run``.

    "rover@0:" finds all of rover's runs.
    """
    found = []
    for pid in procfs.pids():
        with contextlib.suppress(OSError):
            if pid != os.getpid() and (leftover := _leftover_of(pid, run)):
                found.append(leftover)
    return found


def leftovers_of(pids: Iterable[int], run: str) -> list[Leftover]:
    """Return those of these processes that run, as what this run left behind."""
    found = []
    for pid in pids:
        with contextlib.suppress(OSError):
            found.append(Leftover(pid, run, _command(pid), procfs.stat(pid).began))
    return found


def signal_leftovers(run: str, processes: Collection[str], number: signal.Signals) -> None:
    """Send the signal to what these processes, which have ended, left behind in this very run."""
    for leftover in leftovers(run):
        if leftover.process in processes:
            _send(leftover, number)


def end(found: list[Leftover], patience_s: float = 2.0) -> list[Leftover]:
    """Have them end, kill those that do not, and return those that are still there."""
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
    """Return the launcher's number if it still runs, in this network."""
    number, _, since = mark.partition(":")
    with contextlib.suppress(OSError, ValueError):
        pid = int(number)
        same = procfs.network(pid) == procfs.network("self")
        return pid if same and procfs.stat(pid).began == int(since) else None
    return None


def _send(leftover: Leftover, number: int) -> None:
    """Send the signal to that very process, and to no other that was given its number since."""
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
