"""Kernel settings of a process, applied before its program starts and checked beforehand.

A setting is a row of ``SETTINGS``. It has the process's key, a function that applies the setting
to the calling process, and a function that checks it without changing the calling process.
"""

from __future__ import annotations

import os
import resource
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tfcompose.foundation.findings import Finding, finding
from tfcompose.foundation.procfs import OOM_SCORE

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from tfcompose.model.plan import PlanProcess, Schedule, SchedulingPolicy


@dataclass(frozen=True, slots=True)
class KernelSetting:
    """A key of a process whose value the kernel enforces."""

    key: str
    #: Applies a value to this process and the programs that it starts. Raises OSError or
    #: ValueError if the kernel rejects the value.
    apply: Callable[[Any], None]
    #: Takes the name of the process and a value. Returns the finding if the kernel would reject
    #: the value.
    refusal: Callable[[str, Any], Finding | None]


def apply_settings(process: PlanProcess) -> None:
    """Apply the plan's kernel settings to this process and the programs that it starts.

    Raises:
        OSError: if the kernel rejects a setting.
        ValueError: if the kernel rejects a limit.
    """
    for setting, value in _set(process):
        setting.apply(value)


def check_settings(process: PlanProcess) -> list[Finding]:
    """Return findings for settings that the kernel would reject. This process is unchanged."""
    refusals = [setting.refusal(process.name, value) for setting, value in _set(process)]
    return [refusal for refusal in refusals if refusal]


def has_settings(process: PlanProcess) -> bool:
    """Return whether the plan has kernel settings for the process."""
    return any(_set(process))


def _set(process: PlanProcess) -> Iterator[tuple[KernelSetting, Any]]:
    """Yield the settings that the process has, with their values."""
    for setting in SETTINGS:
        value = getattr(process, setting.key)
        if value is not None:
            yield setting, value


# The schedule.

_POLICIES: dict[SchedulingPolicy, int] = {
    "other": os.SCHED_OTHER,
    "batch": os.SCHED_BATCH,
    "idle": os.SCHED_IDLE,
    "fifo": os.SCHED_FIFO,
    "rr": os.SCHED_RR,
}


def _apply_schedule(schedule: Schedule) -> None:
    if schedule.cpus:
        os.sched_setaffinity(0, schedule.cpus)
    if schedule.policy != "other":
        os.sched_setscheduler(0, _POLICIES[schedule.policy], os.sched_param(schedule.priority))


def _schedule_refusal(name: str, schedule: Schedule) -> Finding | None:
    """Return the finding for a rejected schedule. A short-lived thread tries the schedule."""
    try:
        with ThreadPoolExecutor(1) as thread:
            lacking = set(schedule.cpus) - thread.submit(_cpus_with, schedule).result()
    except PermissionError:
        message = (
            f"this user may not start {name} with policy {schedule.policy} and priority"
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
    message = f"{name} cannot run on {', '.join(f'CPU {cpu}' for cpu in sorted(lacking))}"
    return finding("TF911", message, None, help="CPUs count from 0; lscpu lists them")


def _cpus_with(schedule: Schedule) -> set[int]:
    """Apply the schedule to this thread permanently, and return the thread's CPUs."""
    _apply_schedule(schedule)
    return os.sched_getaffinity(0)


# Order in which the kernel kills processes when memory runs out.

_SCORE = Path(OOM_SCORE)


def _apply_score(score: int) -> None:
    _SCORE.write_text(str(score), encoding="utf-8")


def _score_refusal(name: str, score: int) -> Finding | None:
    """Return the finding for a rejected score.

    The kernel rejects a score below the lowest score since a privileged start.
    """
    before = int(_SCORE.read_text(encoding="utf-8"))
    if score >= before:
        return None
    try:
        _apply_score(score)
    except OSError:
        message = f"this user may not start {name} with oom_score_adj {score}"
        advice = f"{before} or more, or the capability CAP_SYS_RESOURCE"
        return finding("TF911", message, None, help=advice)
    _apply_score(before)
    return None


# Limit of open files.


def _apply_open_files(count: int) -> None:
    resource.setrlimit(resource.RLIMIT_NOFILE, (count, count))


def _open_files_refusal(name: str, count: int) -> Finding | None:
    """Return the finding for a rejected limit: above the hard limit or the kernel's limit."""
    before = resource.getrlimit(resource.RLIMIT_NOFILE)
    if count <= before[1]:
        return None
    try:
        _apply_open_files(count)
    except (OSError, ValueError):
        message = f"this user may not start {name} with open_files {count}"
        advice = (
            f"{before[1]} or less, or nofile in /etc/security/limits.conf, or the capability"
            " CAP_SYS_RESOURCE; the maximum is fs.nr_open"
        )
        return finding("TF911", message, None, help=advice)
    resource.setrlimit(resource.RLIMIT_NOFILE, before)
    return None


SETTINGS = (
    KernelSetting("schedule", _apply_schedule, _schedule_refusal),
    KernelSetting("oom_score_adj", _apply_score, _score_refusal),
    KernelSetting("open_files", _apply_open_files, _open_files_refusal),
)
