"""Processes of a run, found by the run's id in their environment: also those that left their group and session."""

from __future__ import annotations

import contextlib
import os
import signal
import time
from dataclasses import dataclass
from pathlib import Path

from tfcompose.run.place import RUN_ID

#: The variable that names the launcher of a run: its process number, and when it began (clock ticks).
LAUNCHER = "TFCOMPOSE_LAUNCHER"
#: The kernel ends a killed process within this time, in seconds, also where much is going on.
KILLED_WITHIN_S = 5.0


@dataclass(frozen=True, slots=True)
class Leftover:
    """A process that a run started: its number, its run's id, its command, and when it began (clock ticks).

    ``launcher`` is the number of the run's launcher if that one still runs: then nothing was left behind.
    """

    pid: int
    run: str
    command: str
    began: int
    launcher: int | None = None


def launcher_mark() -> str:
    """Return what a process of a run is told of its launcher, which is this process."""
    return f"{os.getpid()}:{_began(Path('/proc/self'))}"


def leftovers(run: str) -> list[Leftover]:
    """Return the processes whose run's id is, or begins with, ``run``: "rover@0:" finds all of rover's runs."""
    found = []
    for folder in Path("/proc").iterdir():
        if not folder.name.isdigit() or int(folder.name) == os.getpid():
            continue
        with contextlib.suppress(OSError, ValueError, IndexError):
            one = _look(folder, run)
            if one:
                found.append(one)
    return sorted(found, key=lambda one: one.pid)


def variables_of(pid: int) -> dict[str, str]:
    """Return the environment that a process was started with.

    Raises:
        OSError: if the process has ended, or is somebody else's.
    """
    words = (Path("/proc") / str(pid) / "environ").read_bytes().decode(errors="replace").split("\0")
    return {name: value for name, _, value in (word.partition("=") for word in words)}


def _look(folder: Path, run: str) -> Leftover | None:
    if RUN_ID.encode() not in (folder / "environ").read_bytes():
        return None
    env = variables_of(int(folder.name))
    if not env.get(RUN_ID, "").startswith(run):
        return None
    words = (folder / "cmdline").read_bytes().rstrip(b"\0").split(b"\0")
    command = b" ".join(words).decode(errors="replace")[:200]
    return Leftover(int(folder.name), env[RUN_ID], command, _began(folder), _launcher(env.get(LAUNCHER, "")))


def _launcher(mark: str) -> int | None:
    """Return the launcher's number if it still runs, in this network."""
    pid, _, began = mark.partition(":")
    with contextlib.suppress(OSError, ValueError, IndexError):
        folder = Path("/proc") / str(int(pid))
        same = (folder / "ns/net").readlink() == Path("/proc/self/ns/net").readlink()
        return int(pid) if same and _began(folder) == int(began) else None
    return None


def _began(folder: Path) -> int:
    return int((folder / "stat").read_text().rpartition(")")[2].split()[19])


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
    folder = Path("/proc") / str(one.pid)
    try:
        state = (folder / "stat").read_text().rpartition(")")[2].split()[0]
        return _began(folder) == one.began and state != "Z"
    except (OSError, IndexError):
        return False
