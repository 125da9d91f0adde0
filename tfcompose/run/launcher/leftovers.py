"""Processes that a run left behind: those with the run's id in their environment, and a launcher's descendants.

Both find also what left its group and session; the first also where the launcher was killed.
"""

from __future__ import annotations

import contextlib
import os
import signal
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

from tfcompose.ipc import LAUNCHER, PROCESS, RUN_ID
from tfcompose.run.launcher.processes import BEGAN, PROC, STATE, all_pids, began, fields_of

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable

#: The kernel ends a killed process within this time, in seconds, also where much is going on.
KILLED_WITHIN_S = 5.0


@dataclass(frozen=True, slots=True)
class Leftover:
    """A process that a run started: its number, its run's id, its command, and when it began (clock ticks).

    ``launcher`` is the number of the run's launcher if that one still runs: then nothing was left behind. ``process``
    is the plan's process that started it, as far as it says.
    """

    pid: int
    run: str
    command: str
    began: int
    launcher: int | None = None
    process: str = ""


def launcher_mark() -> str:
    """Return what a process of a run is told of its launcher, which is this process."""
    return f"{os.getpid()}:{began('self')}"


def leftovers(run: str) -> list[Leftover]:
    """Return the processes whose run's id is, or begins with, ``run``: "rover@0:" finds all of rover's runs."""
    found = []
    for pid in all_pids():
        with contextlib.suppress(OSError, ValueError, IndexError):
            if pid != os.getpid() and (one := _marked(pid, run)):
                found.append(one)
    return sorted(found, key=lambda one: one.pid)


def these(pids: Iterable[int], run: str) -> list[Leftover]:
    """Return those of these processes that run, as what this run left behind."""
    found = []
    for pid in pids:
        with contextlib.suppress(OSError, ValueError, IndexError):
            found.append(Leftover(pid, run, _command(pid), began(pid)))
    return found


def variables_of(pid: int) -> dict[str, str]:
    """Return the environment that a process was started with.

    Raises:
        OSError: if the process has ended, or is somebody else's.
    """
    words = (PROC / str(pid) / "environ").read_bytes().decode(errors="replace").split("\0")
    return {name: value for name, _, value in (word.partition("=") for word in words)}


def _marked(pid: int, run: str) -> Leftover | None:
    if RUN_ID.encode() not in (PROC / str(pid) / "environ").read_bytes():
        return None
    env = variables_of(pid)
    if not env.get(RUN_ID, "").startswith(run):
        return None
    return Leftover(pid, env[RUN_ID], _command(pid), began(pid), _launcher(env.get(LAUNCHER, "")), env.get(PROCESS, ""))


def _command(pid: int) -> str:
    words = (PROC / str(pid) / "cmdline").read_bytes().rstrip(b"\0").split(b"\0")
    return b" ".join(words).decode(errors="replace")[:200]


def _launcher(mark: str) -> int | None:
    """Return the launcher's number if it still runs, in this network."""
    pid, _, since = mark.partition(":")
    with contextlib.suppress(OSError, ValueError, IndexError):
        same = (PROC / str(int(pid)) / "ns/net").readlink() == (PROC / "self/ns/net").readlink()
        return int(pid) if same and began(pid) == int(since) else None
    return None


def tell(run: str, processes: Collection[str], number: signal.Signals) -> None:
    """Send the signal to what these processes, which have ended, left behind in this very run."""
    for one in leftovers(run):
        if one.process in processes:
            _send(one, number)


def end(found: list[Leftover], patience_s: float = 2.0) -> list[Leftover]:
    """Tell them to end, kill those that do not, and return those that are still there."""
    for number, wait_s in ((signal.SIGTERM, patience_s), (signal.SIGKILL, KILLED_WITHIN_S)):
        for one in found:
            _send(one, number)
        until = time.monotonic() + wait_s
        while (found := [one for one in found if _is_there(one)]) and time.monotonic() < until:
            time.sleep(0.02)
        if not found:
            break
    return found


def _send(one: Leftover, number: int) -> None:
    """Send the signal to that very process, and to no other that was given its number since."""
    with contextlib.suppress(OSError):
        descriptor = os.pidfd_open(one.pid)
        try:
            if _is_there(one):
                signal.pidfd_send_signal(descriptor, number)
        finally:
            os.close(descriptor)


def _is_there(one: Leftover) -> bool:
    try:
        fields = fields_of(one.pid)
        return int(fields[BEGAN]) == one.began and fields[STATE] != "Z"
    except (OSError, IndexError, ValueError):
        return False
