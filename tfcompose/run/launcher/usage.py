"""What process groups use: parts of a processor core, and proportional memory in bytes."""

from __future__ import annotations

import contextlib
import os
import time

from tfcompose.run.launcher.processes import GROUP, PROC, SYSTEM_TICKS, USER_TICKS, all_pids, fields_of

#: The processor's use is measured over this time, in seconds.
OVER_S = 0.2


def usage_of(groups: list[int]) -> dict[int, tuple[float, int]]:
    """Return (cores, bytes) for each group that has processes."""
    if not groups:
        return {}
    members = _members(set(groups))
    begun = time.monotonic()
    before = {pid: _ticks(pid) for pids in members.values() for pid in pids}
    time.sleep(OVER_S)
    seconds = time.monotonic() - begun
    used = {}
    for group, pids in members.items():
        ticks = sum(_ticks(pid) - before[pid] for pid in pids)
        used[group] = (round(max(ticks, 0) / os.sysconf("SC_CLK_TCK") / seconds, 3), sum(map(_memory, pids)))
    return used


def _members(groups: set[int]) -> dict[int, list[int]]:
    members: dict[int, list[int]] = {}
    for pid in all_pids():
        with contextlib.suppress(OSError, IndexError, ValueError):
            group = int(fields_of(pid)[GROUP])
            if group in groups:
                members.setdefault(group, []).append(pid)
    return members


def _ticks(pid: int) -> int:
    try:
        fields = fields_of(pid)
        return int(fields[USER_TICKS]) + int(fields[SYSTEM_TICKS])
    except (OSError, IndexError, ValueError):
        return 0


def _memory(pid: int) -> int:
    with contextlib.suppress(OSError, IndexError, ValueError):
        for line in (PROC / str(pid) / "smaps_rollup").read_text(encoding="ascii").splitlines():
            if line.startswith("Pss:"):
                return int(line.split()[1]) * 1024
    return 0
