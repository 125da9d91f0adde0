"""Other processes on this machine that have ROS loaded, and the settings that they were started with.

It is read from /proc, and so of one's own processes on Linux only. This module imports no ROS.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

_PROC = Path("/proc")
_LIBRARY = b"librcl.so"
_PREFIXES = ("ROS_", "RMW_")
_SHOWN = 100


def ros_processes() -> Iterator[tuple[int, str, dict[str, str]]]:
    """Give pid, command line and ROS's variables of each process that has rcl loaded, but this one."""
    for entry in sorted(_PROC.glob("[0-9]*"), key=lambda path: int(path.name)):
        if entry.name == str(os.getpid()):
            continue
        try:
            if _LIBRARY not in (entry / "maps").read_bytes():
                continue
            environment = (entry / "environ").read_bytes()
            command = (entry / "cmdline").read_bytes()
        except OSError:  # somebody else's, or it has just ended
            continue
        yield int(entry.name), _shown(command), settings_in(environment)


def settings_in(environment: bytes) -> dict[str, str]:
    """Return ROS's variables of an environment as /proc shows it: NAME=VALUE, each ended by a NUL."""
    pairs = (word.decode(errors="replace").partition("=") for word in environment.split(b"\0"))
    return {name: value for name, _, value in pairs if name.startswith(_PREFIXES)}


def _shown(command: bytes) -> str:
    line = " ".join(command.decode(errors="replace").replace("\0", " ").split())
    return line if len(line) <= _SHOWN else f"{line[:_SHOWN]}…"
