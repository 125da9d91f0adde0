"""Processor time and memory of processes, whole or with all below them."""

from __future__ import annotations

import os
import subprocess
import sys
from typing import TYPE_CHECKING

import psutil

if TYPE_CHECKING:
    from collections.abc import Iterable

    from tests.benchmarks.benchmark import Workspace


def usage(workspace: Workspace, *argv: str) -> tuple[float, float]:
    """Run a Python program to its end.

    Return its processor time, user and system, in seconds, and its largest resident size in MB.

    Raises:
        RuntimeError: if it does not end with 0.
    """
    errors = workspace.folder / "errors.txt"
    with errors.open("wb") as out:
        process = subprocess.Popen(
            [sys.executable, *argv],
            cwd=workspace.folder,
            env=dict(workspace.environment),
            stdout=subprocess.DEVNULL,
            stderr=out,
        )
    try:
        _, status, used = os.wait4(process.pid, 0)
    except BaseException:
        process.kill()
        process.wait()
        raise
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        text = errors.read_text("utf-8")
        raise RuntimeError(f"{argv} ended with {process.returncode}: {text}")
    return used.ru_utime + used.ru_stime, used.ru_maxrss / 1000


def tree(pid: int) -> list[psutil.Process]:
    """Return a process and all below it."""
    process = psutil.Process(pid)
    return [process, *process.children(recursive=True)]


def cpu_s(processes: Iterable[psutil.Process]) -> float:
    """Return the processor time of these processes until now, user and system, in seconds."""
    return float(sum(sum(process.cpu_times()[:2]) for process in processes))


def pss_mb(processes: Iterable[psutil.Process]) -> float:
    """Return the memory of these processes in MB; pages shared by several are divided."""
    return float(sum(process.memory_full_info().pss for process in processes)) / 1e6
