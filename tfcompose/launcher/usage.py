"""CPU and memory usage of process groups."""

from __future__ import annotations

import contextlib
import os
import time
from typing import TYPE_CHECKING

from tfcompose.foundation import procfs

if TYPE_CHECKING:
    from collections.abc import Collection

#: CPU usage is measured over this time, in seconds.
OVER_S = 0.2


class UsageMeter:
    """Measures CPU and memory usage of process groups."""

    def __init__(self) -> None:
        self._ticks: dict[int, int] = {}
        self._at = time.monotonic()

    def begin(self, groups: Collection[int]) -> dict[int, list[int]]:
        """Start a measurement, and return the processes of each non-empty group."""
        members = _members(set(groups)) if groups else {}
        self._at = time.monotonic()
        self._ticks = {pid: _ticks(pid) for pids in members.values() for pid in pids}
        return members

    def usage(self, groups: Collection[int]) -> dict[int, tuple[float, int]]:
        """Return (cores, bytes) for each group that has processes.

        Memory is the proportional set size (PSS). Cores are averages since the previous call. A
        process that started since then counts from the next call on.
        """
        since_s, before = self._at, self._ticks
        members = self.begin(groups)
        ticks_per_core = os.sysconf("SC_CLK_TCK") * max(self._at - since_s, 1e-3)
        used = {}
        for group, pids in members.items():
            ticks = sum(self._ticks[pid] - before.get(pid, self._ticks[pid]) for pid in pids)
            used[group] = (round(max(ticks, 0) / ticks_per_core, 3), sum(map(_memory, pids)))
        return used


def usage_of(groups: Collection[int]) -> dict[int, tuple[float, int]]:
    """Return (cores, bytes) for each group that has processes. Memory is PSS."""
    meter = UsageMeter()
    if not meter.begin(groups):
        return {}
    time.sleep(OVER_S)
    return meter.usage(groups)


def _members(groups: set[int]) -> dict[int, list[int]]:
    members: dict[int, list[int]] = {}
    for pid in procfs.pids():
        with contextlib.suppress(OSError):
            group = os.getpgid(pid)
            if group in groups:
                members.setdefault(group, []).append(pid)
    return members


def _ticks(pid: int) -> int:
    with contextlib.suppress(OSError):
        return procfs.stat(pid).ticks
    return 0


def _memory(pid: int) -> int:
    with contextlib.suppress(OSError):
        return procfs.memory_bytes(pid)
    return 0
