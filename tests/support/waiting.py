"""How tests wait: for what is to come to pass, and no longer."""

import re
import threading
import time
from collections.abc import Callable
from pathlib import Path

import psutil

#: So long a busy machine may keep what comes to pass; where all is well nobody waits for it.
TIMEOUT_S = 60.0


def until(condition: Callable[[], object], timeout_s: float = TIMEOUT_S) -> bool:
    """Look every few milliseconds until the condition holds; return whether it did in time.

    The longer it takes, the more rarely it looks: others need the processor that it waits for.
    """
    begun = time.monotonic()
    while not condition():
        waited_s = time.monotonic() - begun
        if waited_s > timeout_s:
            return False
        time.sleep(min(0.005 + waited_s / 50, 0.03))
    return True


def in_one_of_a_few(attempt: Callable[[int], bool], tries: int = 4) -> bool:
    """Return whether one of a few attempts holds; each is given its number.

    A machine that is busy with other things may spoil one now and then; what is wrong is wrong
    each time.
    """
    return any(attempt(number) for number in range(tries))


def complete_lines(file: Path) -> list[str]:
    """Return the lines of a file that somebody still writes.

    What stands behind the last line's end is not one yet.
    """
    return file.read_bytes().rpartition(b"\n")[0].decode().splitlines()


def offences(output: str) -> list[str]:
    """Return the codes of what was found live, but of silence and slowness.

    A process may be kept from running.
    """
    return re.findall(r"TF8(?!0[45])\d\d", output)


def gone(process: int | psutil.Process) -> bool:
    """Return whether the process has ended: nobody may have buried it yet."""
    try:
        handle = psutil.Process(process) if isinstance(process, int) else process
        return not handle.is_running() or bool(handle.status() == psutil.STATUS_ZOMBIE)
    except psutil.NoSuchProcess:
        return True


def none_but(threads: list[threading.Thread]) -> bool:
    """Wait until all threads have ended but these, some of which may end meanwhile.

    Return whether they did in time.
    """
    return until(lambda: set(threading.enumerate()) <= set(threads))
