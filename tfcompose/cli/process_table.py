"""Table of a robot's processes in ``ps`` and the live view of ``up``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.cli.tables import Table
from tfcompose.compiler.render.text import GREEN, RED, YELLOW

if TYPE_CHECKING:
    from tfcompose.model.messages import ProcessStatus, RobotStatus

    #: Usage of processes: (CPU in cores, memory in bytes) by process number.
    Usage = dict[int, tuple[float, int]]

#: Maximum number of characters of a state's reason in the table. JSON contains the complete
#: reason.
LONGEST_WHY = 40
HEAD = ("PROCESS", "STATE", "PID", "UPTIME", "RESTARTS", "CPU", "MEMORY", "EDGES")


def state_of(status: RobotStatus) -> str:
    """Return the state of a robot in words."""
    if status.stopping:
        return "stopping"
    return "tree complete" if status.complete else "tree not complete"


def row(process: ProcessStatus, used: Usage) -> tuple[str, ...]:
    """Return the cells of a process. ``used`` is the usage of each process group, if known."""
    cpu, memory = used.get(process.pid or 0, (None, None))
    return (
        process.name,
        _state(process),
        str(process.pid or "–"),
        "–" if process.uptime is None else uptime(process.uptime),
        str(process.restarts),
        "–" if cpu is None else f"{cpu:.0%}",
        "–" if memory is None else f"{memory / 1e6:.0f} MB",
        f"{process.live}/{process.edges}" if process.edges else "–",
    )


def _state(process: ProcessStatus) -> str:
    """Return the state in words, with the reason if it is not obvious."""
    state = process.state
    if process.state == "expected":
        return f"{state} of {process.host}" if process.host else state
    if process.state == "running":
        return state if process.ready else f"{state}, not ready"
    if process.state == "stopped" and process.waits:  # the launcher will start it
        return process.waits
    why = (
        f" ({process.detail[:LONGEST_WHY]}{'…' * (len(process.detail) > LONGEST_WHY)})"
        if process.detail
        else ""
    )
    return f"{state}{why}{', failed' if process.failed and state != 'fatal' else ''}"


def _colour(column: int, text: str) -> str:
    if HEAD[column] != "STATE" or text == "STATE":
        return ""
    if text == "running":
        return GREEN
    return RED if text.startswith("fatal") or text.endswith("failed") else YELLOW


def uptime(seconds: float) -> str:
    """Return an uptime as text: 42 s, 3:07 min or 12:30 h."""
    total_s = int(seconds)
    if total_s < 60:  # noqa: PLR2004 (seconds of a minute)
        return f"{total_s} s"
    minutes, rest = divmod(total_s, 60)
    if minutes < 60:  # noqa: PLR2004 (minutes of an hour)
        return f"{minutes}:{rest:02d} min"
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d} h"


TABLE = Table(least={1: 20, 0: 16}, spare=(5, 4, 3), colour=_colour)
