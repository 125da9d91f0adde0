"""What a running robot still waits for, in words."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from tfcompose.cli.terminal import complain
from tfcompose.ipc import RobotStatus, StatusRequest
from tfcompose.run.launcher.control import ask

if TYPE_CHECKING:
    from tfcompose.ipc import ProcessStatus
    from tfcompose.run.place import Place

NAMED_AT_MOST = 12
ASK_EVERY_S = 0.1


def until_ready(place: Place, timeout_s: float | None) -> int:
    """Wait until every process is ready and every edge live; 0 then, and 1 after saying why that did not come."""
    end = None if timeout_s is None else time.monotonic() + timeout_s
    while True:
        try:
            status = ask(place, StatusRequest(), RobotStatus)
        except OSError:
            complain(f"{place.name} has ended; tfcompose logs says why")
            return 1
        if status.ready:
            return 0
        if timeout_s is not None and end is not None and time.monotonic() >= end:
            say_missing(place, timeout_s)
            return 1
        time.sleep(ASK_EVERY_S)


def say_missing(place: Place, timeout_s: float) -> None:
    """Complain about each process that is not ready, and each edge that is not live."""
    try:
        status = ask(place, StatusRequest(), RobotStatus)
    except OSError as error:
        complain(f"{place.name} does not answer: {error}")
        return
    missing = status.missing
    complain(f"{place.name} is not ready after {timeout_s:g} s; it goes on: tfcompose logs, tfcompose down")
    for process in status.processes:
        if process.failed:
            complain(f"  failed: {process.name} ({process.state.lower()}, {process.detail})")
        elif not process.ready and process.state != "EXITED":
            complain(f"  not ready: {process.name} ({_why(process)})")
    if missing:
        more = f" and {len(missing) - NAMED_AT_MOST} more" if len(missing) > NAMED_AT_MOST else ""
        complain(f"  not live: {', '.join(missing[:NAMED_AT_MOST])}{more}")


def _why(process: ProcessStatus) -> str:
    """Return what it waits for before its start; else its state, what it is without, and what is seen there."""
    if process.state == "STOPPED" and process.waits:
        return process.waits
    parts = [process.state.lower()]
    if process.edges:
        parts.append(f"{process.live} of {process.edges} edges live")
    elif process.waits:
        parts.append(process.waits)
    if process.seen:
        parts.append(f"seen instead: {process.seen}")
    return ", ".join(parts)
