"""``tfcompose ps``: the processes of running robots.

Print each process with its state, number, time, restarts, use of the processor and of memory (proportional, with
everything in its group), and how many of the edges that it owns are live.
"""

from __future__ import annotations

import json
import sys
from typing import TYPE_CHECKING, Any

from tfcompose.cli.running import add_robot, asked, is_meant, running
from tfcompose.cli.terminal import UNREADABLE, complain
from tfcompose.ipc import RobotStatus, StatusRequest
from tfcompose.plan.codec import encode
from tfcompose.run.launcher.usage import usage_of
from tfcompose.run.place import PlaceError

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace

    from tfcompose.ipc import ProcessStatus

    #: (cores, bytes) by process number.
    Usage = dict[int, tuple[float, int]]

#: So much of why a process is in its state fits into the table, in characters; JSON has all of it.
LONGEST_WHY = 40
HEAD = ("PROCESS", "STATE", "PID", "UPTIME", "RESTARTS", "CPU", "MEMORY", "EDGES")


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    add_robot(parser)
    parser.add_argument("--format", choices=("text", "json"), default="text", help="default: text")


def run(arguments: Namespace) -> int:
    """Print the table; exit code 0, 1 where no robot runs."""
    try:
        robots, code = _robots(arguments.robot)
    except PlaceError as error:
        complain(str(error))
        return UNREADABLE
    used = usage_of([process.pid for status in robots.values() for process in status.processes if process.pid])
    if arguments.format == "json":
        sys.stdout.write(json.dumps([_as_json(name, status, used) for name, status in robots.items()], indent=1) + "\n")
        return code if robots else 1
    if not robots and not code:
        complain("no robot is running" if arguments.robot is None else f"{arguments.robot} is not running")
        return 1
    for name, status in robots.items():
        state = "stopping" if status.stopping else "tree complete" if status.complete else "tree not complete"
        failed = [process.name for process in status.processes if process.failed]
        state += f", without {', '.join(failed)}" if failed else ""
        sys.stdout.write(f"{name}: {state}, launcher {status.launcher}, since {_time(status.uptime)}\n")
        _table([_row(process, used) for process in status.processes])
    return code


def _robots(name: str | None) -> tuple[dict[str, RobotStatus], int]:
    """Return those that answer, by their names, and the exit code: 1 after saying who does not."""
    found, code = {}, 0
    for place, _ in running():
        answer = asked(place, StatusRequest(), RobotStatus) if is_meant(place, name) else 0
        if isinstance(answer, int):
            code = code or answer
        else:
            found[place.name] = answer
    return found, code


def _as_json(name: str, status: RobotStatus, used: Usage) -> dict[str, Any]:
    data: dict[str, Any] = {"name": name} | encode(status)
    for process in data["processes"]:
        cpu, memory = used.get(process["pid"], (None, None))
        process |= {"cpu": cpu, "memory": memory}
    return data


def _row(process: ProcessStatus, used: Usage) -> tuple[str, ...]:
    cpu, memory = used.get(process.pid or 0, (None, None))
    return (
        process.name,
        _state(process),
        str(process.pid or "–"),
        "–" if process.uptime is None else _time(process.uptime),
        str(process.restarts),
        "–" if cpu is None else f"{cpu:.0%}",
        "–" if memory is None else f"{memory / 1e6:.0f} MB",
        f"{process.live}/{process.edges}" if process.edges else "–",
    )


def _state(process: ProcessStatus) -> str:
    """Return the state in words, with why it is in it where that is not plain."""
    state = process.state.lower()
    if process.state == "EXPECTED":
        return f"{state} of {process.host}" if process.host else state
    if process.state == "RUNNING":
        return state if process.ready else f"{state}, not ready"
    if process.state == "STOPPED" and process.waits:  # it will be started
        return process.waits
    why = f" ({process.detail[:LONGEST_WHY]}{'…' * (len(process.detail) > LONGEST_WHY)})" if process.detail else ""
    return f"{state}{why}{', failed' if process.failed and state != 'fatal' else ''}"


def _table(rows: list[tuple[str, ...]]) -> None:
    widths = [max(map(len, column)) for column in zip(HEAD, *rows, strict=True)]
    for row in (HEAD, *rows):
        line = "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True))
        sys.stdout.write(f"  {line.rstrip()}\n")


def _time(seconds: float) -> str:
    whole = int(seconds)
    if whole < 60:  # noqa: PLR2004 (seconds of a minute)
        return f"{whole} s"
    minutes, rest = divmod(whole, 60)
    if minutes < 60:  # noqa: PLR2004 (minutes of an hour)
        return f"{minutes}:{rest:02d} min"
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d} h"
