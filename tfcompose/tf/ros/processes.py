"""Processes of this machine that have ROS loaded, and the process behind a publisher's id.

With Fast DDS an id begins with the vendor's number (01 0f), two bytes for the host, and the lower
half of the process id (``GuidUtils``, Fast DDS 2.14). Two machines can have the same two bytes. So
a process is named only if exactly one matches. Processes of other users, and systems other than
Linux, cannot be inspected. This module imports no ROS.
"""

from __future__ import annotations

import os
import time
from typing import TYPE_CHECKING

from tfcompose.foundation import procfs
from tfcompose.foundation.text import mask_invisible

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

_LIBRARY = "librcl.so"
#: Minimum number of threads of a process that uses a middleware. A process that has only loaded
#: ROS, such as a launcher that forks other processes, has its own thread and two threads of LTTng.
_FEWEST_THREADS = 4
_PREFIXES = ("ROS_", "RMW_")
#: Maximum number of characters of a command line to display.
_SHOWN = 100
_VENDOR = b"\x01\x0f"
_WORD = 1 << 16


def ros_processes() -> Iterator[tuple[int, str, dict[str, str]]]:
    """Yield pid, command and ROS variables of each other process with rcl loaded."""
    for pid in procfs.pids():
        if pid == os.getpid():
            continue
        try:
            if procfs.threads(pid) < _FEWEST_THREADS or not procfs.has_loaded(pid, _LIBRARY):
                continue
            variables, command = (
                ros_variables(procfs.environ(pid)),
                _show_command(procfs.argv(pid)),
            )
        except OSError:  # another user's process, or it has just ended
            continue
        yield pid, command, variables


def ros_variables(environment: Mapping[str, str]) -> dict[str, str]:
    """Return the ROS variables of an environment."""
    return {name: value for name, value in environment.items() if name.startswith(_PREFIXES)}


def origin(gid: bytes, own_gid: bytes) -> str:
    """Return where a publisher runs: "on this machine as pid 7: …", "on another machine".

    Empty if unknown. ``own_gid`` is an id of this process.
    """
    if not _is_known(gid, own_gid):
        return ""
    if gid[2:4] != own_gid[2:4]:
        return "on another machine"
    fitting = [(pid, line) for pid in _candidates(gid) if (line := _command(pid))]
    if len(fitting) != 1:
        return "on this machine"
    pid, line = fitting[0]
    return f"on this machine as pid {pid}: {line}"


def environments(gid: bytes, own_gid: bytes) -> list[dict[str, str]] | None:
    """Return the initial environments of the processes that may own the publisher.

    There are several if more processes match the id's half of a process id, and none if the
    publisher runs on another machine or has ended. None if unknown, because the id has another
    vendor's format or a process belongs to another user.
    """
    if not _is_known(gid, own_gid):
        return None
    if gid[2:4] != own_gid[2:4]:
        return []
    try:
        return [_environment(pid) for pid in _candidates(gid) if _command(pid)]
    except PermissionError:
        return None


def descent(gid: bytes, own_gid: bytes, ancestor: int) -> tuple[int, ...]:
    """Return a publisher's process and its ancestors, up to the child of ``ancestor``.

    Empty if the process is unknown or is not a descendant of ``ancestor``.
    """
    if not _is_known(gid, own_gid) or gid[2:4] != own_gid[2:4]:
        return ()
    fitting = [pid for pid in _candidates(gid) if _command(pid)]
    if len(fitting) != 1:
        return ()
    pids, pid = [], fitting[0]
    while pid not in {0, 1, ancestor}:
        pids.append(pid)
        pid = _parent(pid)
    return tuple(pids) if pid == ancestor else ()


def has_ended(gid: bytes, own_gid: bytes) -> bool:
    """Return whether the process behind an id ran on this machine and has certainly ended."""
    is_here = _is_known(gid, own_gid) and gid[2:4] == own_gid[2:4]
    return is_here and not any(_command(pid) for pid in _candidates(gid))


def began_at(ticks: int) -> float:
    """Return a process's start in seconds since 1970, from clock ticks since boot."""
    return time.time() - time.clock_gettime(time.CLOCK_BOOTTIME) + ticks / os.sysconf("SC_CLK_TCK")


def _is_known(gid: bytes, own_gid: bytes) -> bool:
    return gid[:2] == _VENDOR and own_gid[:2] == _VENDOR


def _candidates(gid: bytes) -> range:
    """Return the process ids whose lower half matches the id."""
    most = procfs.kernel_number("kernel.pid_max") or _WORD
    return range(int.from_bytes(gid[4:6], "little"), most + 1, _WORD)


def _environment(pid: int) -> dict[str, str]:
    """Return the environment of a process; empty if it has just ended.

    Raises:
        PermissionError: if it belongs to another user.
    """
    try:
        return procfs.environ(pid)
    except PermissionError:
        raise
    except OSError:
        return {}


def _parent(pid: int) -> int:
    """Return the process's parent id; 0 if it has just ended."""
    try:
        return procfs.stat(pid).parent
    except OSError:
        return 0


def _command(pid: int) -> str:
    """Return the process's command line for display; empty if there is none."""
    return _show_command(words_of(pid))


def words_of(pid: int) -> list[str]:
    """Return the arguments of a process's command line; empty if they are unreadable."""
    try:
        return procfs.argv(pid)
    except OSError:
        return []


def _show_command(argv: list[str]) -> str:
    line = mask_invisible(" ".join(" ".join(argv).split()), "?")
    return line if len(line) <= _SHOWN else f"{line[:_SHOWN]}…"
