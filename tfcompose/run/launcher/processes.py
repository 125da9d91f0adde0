"""The kernel's list of processes: who descends from whom, in which group, and since when."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

PROC = Path("/proc")
#: Where the fields behind the name stand in ``/proc/PID/stat`` (proc_pid_stat(5)).
STATE, PARENT, GROUP, USER_TICKS, SYSTEM_TICKS, BEGAN = 0, 1, 2, 11, 12, 19


def all_pids() -> Iterator[int]:
    """Yield the numbers of the processes that there are now."""
    return (int(folder.name) for folder in PROC.iterdir() if folder.name.isdigit())


def fields_of(pid: int | str) -> list[str]:
    """Return the fields of ``/proc/PID/stat`` behind the name; ``self`` is this process.

    Raises:
        OSError: if the process has ended.
    """
    return (PROC / str(pid) / "stat").read_text(encoding="utf-8", errors="replace").rpartition(")")[2].split()


def began(pid: int | str) -> int:
    """Return when the process began, in clock ticks since the machine's start.

    Raises:
        OSError: if it has ended.
    """
    return int(fields_of(pid)[BEGAN])


def descendants(ancestor: int, but: int) -> dict[int, int]:
    """Return the group of each process that descends from ``ancestor``, by its number, without ``but`` and its own."""
    parents, groups = {}, {}
    for pid in all_pids():
        with contextlib.suppress(OSError, IndexError, ValueError):
            fields = fields_of(pid)
            if fields[STATE] != "Z":
                parents[pid], groups[pid] = int(fields[PARENT]), int(fields[GROUP])
    found: dict[int, int] = {}
    for pid, group in groups.items():
        above = pid
        while above not in {ancestor, but} and above in parents:
            above = parents[above]
        if above == ancestor and pid != ancestor:
            found[pid] = group
    return found
