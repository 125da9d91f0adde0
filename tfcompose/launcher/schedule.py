"""How the kernel schedules a process: its processors, and its real-time priority."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING

from tfcompose.foundation.findings import Finding, finding

if TYPE_CHECKING:
    from tfcompose.model.plan import PlanProcess, Schedule, SchedulingPolicy

_POLICIES: dict[SchedulingPolicy, int] = {
    "other": os.SCHED_OTHER,
    "batch": os.SCHED_BATCH,
    "idle": os.SCHED_IDLE,
    "fifo": os.SCHED_FIFO,
    "rr": os.SCHED_RR,
}


def apply_schedule(schedule: Schedule) -> None:
    """Have the kernel schedule this process so, and what it becomes and starts.

    Raises:
        OSError: if the kernel refuses it.
    """
    if schedule.cpus:
        os.sched_setaffinity(0, schedule.cpus)
    if schedule.policy != "other":
        os.sched_setscheduler(0, _POLICIES[schedule.policy], os.sched_param(schedule.priority))


def refused_schedule(process: PlanProcess) -> Finding | None:
    """Return what the kernel refuses of a process's schedule; a thread asks it, so that this one stays as it was."""
    schedule = process.schedule
    if schedule is None:
        return None
    try:
        with ThreadPoolExecutor(1) as thread:
            lacking = set(schedule.cpus) - thread.submit(_cpus_with, schedule).result()
    except PermissionError:
        message = (
            f"this user may not start {process.name} with policy {schedule.policy} and priority"
            f" {schedule.priority}"
        )
        advice = (
            "rtprio in /etc/security/limits.conf, LimitRTPRIO= in a systemd unit, or the"
            " capability CAP_SYS_NICE"
        )
        return finding("TF911", message, None, help=advice)
    except (OSError, ValueError, OverflowError):
        lacking = set(schedule.cpus)
    if not lacking:
        return None
    message = f"{process.name} cannot run on {', '.join(f'CPU {one}' for one in sorted(lacking))}"
    return finding("TF911", message, None, help="CPUs count from 0; lscpu lists them")


def _cpus_with(schedule: Schedule) -> set[int]:
    """Have the kernel schedule this thread so, for good, and return the processors that it has then."""
    apply_schedule(schedule)
    return os.sched_getaffinity(0)
