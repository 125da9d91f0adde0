"""The kernel's /proc (proc_pid(5)): processes of this machine, and data about this process.

A process differs from a later process with the same id in its start time. The start time is in
clock ticks since the start of the machine, so it is the same for every reader and does not depend
on the system clock.

A function about a process raises OSError if the process has ended, and PermissionError if it
belongs to another user. ``self`` is this process.
"""

from __future__ import annotations

import os
from contextlib import suppress
from typing import NamedTuple

PROC = "/proc"
#: The file with the score by which the kernel selects processes to kill when memory runs out.
OOM_SCORE = f"{PROC}/self/oom_score_adj"
#: Indices of fields of stat that hold addresses, counted after the name.
_MEMORY_PARTS = {
    "start_code": 23,
    "end_code": 24,
    "start_stack": 25,
    "start_data": 42,
    "end_data": 43,
    "start_brk": 44,
}


class Stat(NamedTuple):
    """State and times of a process, from /proc/PID/stat."""

    state: str
    #: Process id of the parent.
    parent: int
    #: Its process group.
    group: int
    #: CPU time used, in clock ticks.
    ticks: int
    #: Start time, in clock ticks since boot.
    began: int


def pids() -> list[int]:
    """Return the ids of all processes, sorted."""
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
    return {name: int(fields[index]) for name, index in _MEMORY_PARTS.items()}


def environ(pid: int | str) -> dict[str, str]:
    """Return the environment with which the process was started."""
    pairs = (entry.partition("=") for entry in _words(pid, "environ"))
    return {name: value for name, _, value in pairs if name}


def argv(pid: int | str) -> list[str]:
    """Return the process's command line; empty for a kernel thread."""
    return _words(pid, "cmdline")


def has_loaded(pid: int | str, library: str) -> bool:
    """Return whether the process has mapped a file whose path contains ``library``."""
    return library.encode() in _read(pid, "maps")


def mapped_files() -> list[str]:
    """Return the files that this process has mapped into memory."""
    lines = (line.split(None, 5) for line in _read("self", "maps").decode().splitlines())
    return sorted({fields[5] for fields in lines if len(fields) > 5})  # noqa: PLR2004 (the sixth)


def memory_bytes(pid: int | str) -> int:
    """Return the process's memory in bytes, with its share of shared memory (PSS)."""
    for line in _read(pid, "smaps_rollup").splitlines():
        if line.startswith(b"Pss:"):
            return int(line.split()[1]) * 1024
    return 0


def network(pid: int | str) -> str:
    """Return the name of the process's network namespace."""
    return os.readlink(f"{PROC}/{pid}/ns/net")  # noqa: PTH115 (imports less)


def udp_ports() -> set[int]:
    """Return the ports on which a process of this network namespace receives UDP."""
    ports: set[int] = set()
    for name in ("udp", "udp6"):
        with suppress(OSError):  # a kernel without IPv6
            sockets = _read("self/net", name).decode("ascii").splitlines()[1:]
            ports |= {int(line.split()[1].rpartition(":")[2], 16) for line in sockets}
    return ports


def kernel_number(name: str) -> int | None:
    """Return a numeric kernel parameter by its name in sysctl(8), None if it does not exist."""
    try:
        return int(_read("sys", name.replace(".", "/")))
    except (OSError, ValueError):
        return None


def threads(pid: int | str = "self") -> int:
    """Return the number of threads of the process."""
    return os.stat(f"{PROC}/{pid}/task").st_nlink - 2  # noqa: PTH116 (imports less)


def descriptors() -> list[int]:
    """Return the open file descriptors of this process, including one used by this function."""
    return _numbers_in(f"{PROC}/self/fd")


def descriptor(fd: int) -> str:
    """Return a path to an open file of this process."""
    return f"{PROC}/self/fd/{fd}"


def working_dir() -> str:
    """Return the working directory of this process, or its former path if it was removed."""
    return os.readlink(f"{PROC}/self/cwd").removesuffix(" (deleted)")  # noqa: PTH115 (imports less)


def _numbers_in(folder: str) -> list[int]:
    return sorted(int(name) for name in os.listdir(folder) if name.isdecimal())  # noqa: PTH208 (imports less)


def _words(pid: int | str, name: str) -> list[str]:
    data = _read(pid, name).decode(errors="replace").rstrip("\0")
    return data.split("\0") if data else []


def _read(folder: int | str, name: str) -> bytes:
    with open(f"{PROC}/{folder}/{name}", "rb") as stream:  # noqa: PTH123 (imports less)
        return stream.read()
