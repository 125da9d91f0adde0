"""The kernel's /proc (proc_pid(5)): processes of this machine, and what is this process's own.

A process differs from a later one of the same number by when it began, in clock ticks since the
machine's start, which holds in every process and whatever is done to the system's clock.

A function of a process raises OSError where the process has ended, and PermissionError where it is
another user's. ``self`` is this process.
"""

from __future__ import annotations

import os
from typing import NamedTuple

PROC = "/proc"
#: A process's score when memory runs out.
OOM_SCORE = f"{PROC}/self/oom_score_adj"
#: The fields of stat that hold addresses, counted after the name.
_MEMORY_PARTS = {
    "start_code": 23,
    "end_code": 24,
    "start_stack": 25,
    "start_data": 42,
    "end_data": 43,
    "start_brk": 44,
}


class Stat(NamedTuple):
    """A process, from /proc/PID/stat."""

    state: str
    #: Process id of the parent.
    parent: int
    #: Its process group.
    group: int
    #: Processor time that it used, in clock ticks.
    ticks: int
    #: Its start, in clock ticks since boot.
    began: int


def pids() -> list[int]:
    """Return the numbers of all processes, in their order."""
    return _numbers_in(PROC)


def stat(pid: int | str) -> Stat:
    """Return the process's state, parent, group and times.

    Raises:
        OSError: if the process has ended.
    """
    fields = _read(pid, "stat").rpartition(b")")[2].split()
    if not fields:
        raise ProcessLookupError(f"process {pid} has ended")
    return Stat(
        fields[0].decode(),
        int(fields[1]),
        int(fields[2]),
        int(fields[11]) + int(fields[12]),
        int(fields[19]),
    )


def memory_parts() -> dict[str, int]:
    """Return the addresses of this process's code, data and stack, as prctl(2) names them."""
    fields = _read("self", "stat").rpartition(b")")[2].split()
    return {name: int(fields[at]) for name, at in _MEMORY_PARTS.items()}


def environ(pid: int | str) -> dict[str, str]:
    """Return the environment that the process was started with."""
    pairs = (entry.partition("=") for entry in _words(pid, "environ"))
    return {name: value for name, _, value in pairs if name}


def argv(pid: int | str) -> list[str]:
    """Return the process's command line; a thread of the kernel has none."""
    return _words(pid, "cmdline")


def has_loaded(pid: int | str, library: str) -> bool:
    """Return whether the process has a file of that name, or a part of it, in its memory."""
    return library.encode() in _read(pid, "maps")


def mapped_files() -> list[str]:
    """Return the files that this process has in its memory."""
    lines = (line.split(None, 5) for line in _read("self", "maps").decode().splitlines())
    return sorted({fields[5] for fields in lines if len(fields) > 5})  # noqa: PLR2004 (the sixth)


def memory_bytes(pid: int | str) -> int:
    """Return the process's memory; of what it shares, its part (PSS)."""
    for line in _read(pid, "smaps_rollup").splitlines():
        if line.startswith(b"Pss:"):
            return int(line.split()[1]) * 1024
    return 0


def network(pid: int | str) -> str:
    """Return the name of the process's network namespace."""
    return os.readlink(f"{PROC}/{pid}/ns/net")  # noqa: PTH115 (imports less)


def kernel_number(name: str) -> int | None:
    """Return a number of the kernel's, as sysctl(8) names it; None where it has none."""
    try:
        return int(_read("sys", name.replace(".", "/")))
    except (OSError, ValueError):
        return None


def threads(pid: int | str = "self") -> int:
    """Return how many threads the process has."""
    return os.stat(f"{PROC}/{pid}/task").st_nlink - 2  # noqa: PTH116 (imports less)


def descriptors() -> list[int]:
    """Return what this process has opened; one of them was for reading that."""
    return _numbers_in(f"{PROC}/self/fd")


def descriptor(fd: int) -> str:
    """Return a path to what this process has opened."""
    return f"{PROC}/self/fd/{fd}"


def working_dir() -> str:
    """Return the folder that this process runs in; where it was removed, the one that it was."""
    return os.readlink(f"{PROC}/self/cwd").removesuffix(" (deleted)")  # noqa: PTH115 (imports less)


def _numbers_in(folder: str) -> list[int]:
    return sorted(int(name) for name in os.listdir(folder) if name.isdecimal())  # noqa: PTH208 (imports less)


def _words(pid: int | str, name: str) -> list[str]:
    data = _read(pid, name).decode(errors="replace").rstrip("\0")
    return data.split("\0") if data else []


def _read(folder: int | str, name: str) -> bytes:
    with open(f"{PROC}/{folder}/{name}", "rb") as stream:  # noqa: PTH123 (imports less)
        return stream.read()
