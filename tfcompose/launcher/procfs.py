"""The kernel's processes: descendants, what a run left behind, and usage of groups.

They are read from /proc, not with psutil: a process differs from a later one of the same number by
when it began, in clock ticks since the machine's start, which holds in every process and whatever
is done to the system's clock.
"""

from __future__ import annotations

import contextlib
import os
import signal
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.model.variables import LAUNCHER, PROCESS, RUN_ID

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator

PROC = Path("/proc")
#: Where the fields behind the name stand in ``/proc/PID/stat`` (proc_pid_stat(5)).
_STATE, _PARENT, _GROUP, _USER_TICKS, _SYSTEM_TICKS, _BEGAN = 0, 1, 2, 11, 12, 19
#: The kernel ends a killed process within this time, in seconds, also where much is going on.
KILLED_WITHIN_S = 5.0
#: The processor's use is measured over this time, in seconds.
OVER_S = 0.2


def _all_pids() -> Iterator[int]:
    return (int(folder.name) for folder in PROC.iterdir() if folder.name.isdigit())


def _stat(pid: int | str) -> list[str]:
    """Return the fields of ``/proc/PID/stat`` behind the name; ``self`` is this process.

    Raises:
        OSError: if the process has ended.
    """
    return (
        (PROC / str(pid) / "stat")
        .read_text(encoding="utf-8", errors="replace")
        .rpartition(")")[2]
        .split()
    )


def began(pid: int | str) -> int:
    """Return when the process began, in clock ticks since the machine's start.

    ``self`` is this process.

    Raises:
        OSError: if it has ended.
    """
    return int(_stat(pid)[_BEGAN])


def is_suspended(pid: int) -> bool:
    """Return whether the process was stopped, as by Ctrl-Z, and waits to be continued."""
    try:
        return _stat(pid)[_STATE] == "T"
    except (OSError, IndexError):
        return False


def descendants(ancestor: int, but: int) -> dict[int, int]:
    """Return the group of each descendant of ``ancestor``, without ``but`` and its own."""
    parents, groups = {}, {}
    for pid in _all_pids():
        with contextlib.suppress(OSError, IndexError, ValueError):
            fields = _stat(pid)
            if fields[_STATE] != "Z":
                parents[pid], groups[pid] = int(fields[_PARENT]), int(fields[_GROUP])
    found: dict[int, int] = {}
    for pid, group in groups.items():
        above = pid
        while above not in {ancestor, but} and above in parents:
            above = parents[above]
        if above == ancestor and pid != ancestor:
            found[pid] = group
    return found


# What a run left behind: processes with the run's id in their environment, and a launcher's
# descendants. Both find also what left its group and session; the first also where the launcher
# was killed.


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
    return f"{os.getpid()}:{began('self')}"


def leftovers(run: str) -> list[Leftover]:
    """Return the processes whose run's id is, or begins with, ``run``.

    "rover@0:" finds all of rover's runs.
    """
    found = []
    for pid in _all_pids():
        with contextlib.suppress(OSError, ValueError, IndexError):
            if pid != os.getpid() and (one := _marked(pid, run)):
                found.append(one)
    return sorted(found, key=lambda one: one.pid)


def leftovers_of(pids: Iterable[int], run: str) -> list[Leftover]:
    """Return those of these processes that run, as what this run left behind."""
    found = []
    for pid in pids:
        with contextlib.suppress(OSError, ValueError, IndexError):
            found.append(Leftover(pid, run, _command(pid), began(pid)))
    return found


def environment_of(pid: int) -> dict[str, str]:
    """Return the environment that a process was started with.

    Raises:
        OSError: if the process has ended, or belongs to another user.
    """
    words = (PROC / str(pid) / "environ").read_bytes().decode(errors="replace").split("\0")
    return {name: value for name, _, value in (word.partition("=") for word in words)}


def signal_leftovers(run: str, processes: Collection[str], number: signal.Signals) -> None:
    """Send the signal to what these processes, which have ended, left behind in this very run."""
    for one in leftovers(run):
        if one.process in processes:
            _send(one, number)


def end(found: list[Leftover], patience_s: float = 2.0) -> list[Leftover]:
    """Have them end, kill those that do not, and return those that are still there."""
    for number, wait_s in ((signal.SIGTERM, patience_s), (signal.SIGKILL, KILLED_WITHIN_S)):
        for one in found:
            _send(one, number)
        until = time.monotonic() + wait_s
        while (found := [one for one in found if _is_there(one)]) and time.monotonic() < until:
            time.sleep(0.02)
        if not found:
            break
    return found


def _marked(pid: int, run: str) -> Leftover | None:
    if RUN_ID.encode() not in (PROC / str(pid) / "environ").read_bytes():
        return None
    env = environment_of(pid)
    if not env.get(RUN_ID, "").startswith(run):
        return None
    return Leftover(
        pid,
        env[RUN_ID],
        _command(pid),
        began=began(pid),
        launcher=_launcher(env.get(LAUNCHER, "")),
        process=env.get(PROCESS, ""),
    )


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
        fields = _stat(one.pid)
        return int(fields[_BEGAN]) == one.began and fields[_STATE] != "Z"
    except (OSError, IndexError, ValueError):
        return False


# What groups use.


class UsageMeter:
    """Measures what groups of processes use."""

    def __init__(self) -> None:
        self._ticks: dict[int, int] = {}
        self._at = time.monotonic()

    def begin(self, groups: Collection[int]) -> dict[int, list[int]]:
        """Measure from now on; return the processes of each group that has any."""
        members = _members(set(groups)) if groups else {}
        self._at = time.monotonic()
        self._ticks = {pid: _ticks(pid) for pids in members.values() for pid in pids}
        return members

    def usage(self, groups: Collection[int]) -> dict[int, tuple[float, int]]:
        """Return (cores, bytes) for each group that has processes; the memory is proportional.

        The cores are those since the last call; a process that began since then counts from the
        next one on.
        """
        at, before = self._at, self._ticks
        members = self.begin(groups)
        ticks_per_core = os.sysconf("SC_CLK_TCK") * max(self._at - at, 1e-3)
        used = {}
        for group, pids in members.items():
            ticks = sum(self._ticks[pid] - before.get(pid, self._ticks[pid]) for pid in pids)
            used[group] = (round(max(ticks, 0) / ticks_per_core, 3), sum(map(_memory, pids)))
        return used


def usage_of(groups: Collection[int]) -> dict[int, tuple[float, int]]:
    """Return (cores, bytes) for each group that has processes; the memory is proportional."""
    meter = UsageMeter()
    if not meter.begin(groups):
        return {}
    time.sleep(OVER_S)
    return meter.usage(groups)


def _members(groups: set[int]) -> dict[int, list[int]]:
    members: dict[int, list[int]] = {}
    for pid in _all_pids():
        with contextlib.suppress(OSError, IndexError, ValueError):
            group = int(_stat(pid)[_GROUP])
            if group in groups:
                members.setdefault(group, []).append(pid)
    return members


def _ticks(pid: int) -> int:
    try:
        fields = _stat(pid)
        return int(fields[_USER_TICKS]) + int(fields[_SYSTEM_TICKS])
    except (OSError, IndexError, ValueError):
        return 0


def _memory(pid: int) -> int:
    with contextlib.suppress(OSError, IndexError, ValueError):
        for line in (PROC / str(pid) / "smaps_rollup").read_text(encoding="ascii").splitlines():
            if line.startswith("Pss:"):
                return int(line.split()[1]) * 1024
    return 0
