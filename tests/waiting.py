"""How tests wait: for what is to come to pass, and no longer."""

from __future__ import annotations

import threading
import time
from typing import TYPE_CHECKING

import psutil

if TYPE_CHECKING:
    from collections.abc import Callable

#: So long a busy machine may keep what comes to pass; where all is well nobody waits for it.
TIMEOUT_S = 60.0


def until(condition: Callable[[], object], timeout_s: float = TIMEOUT_S) -> bool:
    """Look every few milliseconds until the condition holds; return whether it did in time."""
    end = time.monotonic() + timeout_s
    while not condition():
        if time.monotonic() > end:
            return False
        time.sleep(0.005)
    return True


def gone(process: int | psutil.Process) -> bool:
    """Return whether the process has ended: nobody may have buried it yet."""
    try:
        found = psutil.Process(process) if isinstance(process, int) else process
        return not found.is_running() or bool(found.status() == psutil.STATUS_ZOMBIE)
    except psutil.NoSuchProcess:
        return True


def none_but(threads: list[threading.Thread]) -> bool:
    """Wait until all threads have ended but these, some of which may end meanwhile; return whether they did in time."""
    return until(lambda: set(threading.enumerate()) <= set(threads))
