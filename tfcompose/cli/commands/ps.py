"""List the processes of running robots.

Show state, PID, uptime, restarts, CPU and memory (PSS of the process group) of each process, and how many of its edges
are live.
"""

from __future__ import annotations

import json
import sys
from typing import TYPE_CHECKING, Any

from tfcompose.cli.options import add_format, add_robot
from tfcompose.cli.terminal import FAILED, UNREADABLE, coloured, fail, table_width
from tfcompose.render.text import GREEN, RED, YELLOW

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace

    from tfcompose.ipc import ProcessStatus, RobotStatus

    #: (cores, bytes) by process number.
    Usage = dict[int, tuple[float, int]]

#: So much of why a process is in its state fits into the table, in characters; JSON has all of it.
LONGEST_WHY = 40
HEAD = ("PROCESS", "STATE", "PID", "UPTIME", "RESTARTS", "CPU", "MEMORY", "EDGES")


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    add_robot(parser, "all of this user")
    add_format(parser)


def run(arguments: Namespace) -> int:
    """Print the table; exit code 0, 1 where no robot runs."""
    from tfcompose.cli.tables import Table
    from tfcompose.launcher.procfs import usage_of

    table = Table(least={1: 20, 0: 16}, spare=(5, 4, 3), colour=_colour)
    robots, code = _robots(arguments.robot)
    used = usage_of([process.pid for status in robots.values() for process in status.processes if process.pid])
    if arguments.format == "json":
        print(json.dumps([_as_json(name, status, used) for name, status in robots.items()], indent=1))
        return code if robots else FAILED
    if not robots and not code:
        fail("no robot is running" if arguments.robot is None else f"{arguments.robot} is not running")
    for name, status in robots.items():
        state = "stopping" if status.stopping else "tree complete" if status.complete else "tree not complete"
        failed = [process.name for process in status.processes if process.failed]
        state += f", without {', '.join(failed)}" if failed else ""
        print(f"{name}: {state}, launcher {status.launcher}, since {_time(status.uptime)}")
        rows = [HEAD, *(_row(process, used) for process in status.processes)]
        print(*table.lines(rows, table_width(sys.stdout), coloured=coloured(sys.stdout), indent="  "), sep="\n")
    return code


def _robots(name: str | None) -> tuple[dict[str, RobotStatus], int]:
    """Return those that answer, by their names, and the exit code: 1 after saying who does not."""
    from tfcompose.cli.runs import is_meant, request, running
    from tfcompose.ipc import RobotStatus, StatusRequest
    from tfcompose.launcher.runtime_dir import RuntimeDirError

    try:
        places = [place for place, _ in running() if name is None or is_meant(place, name)]
    except RuntimeDirError as error:
        fail(str(error), UNREADABLE)
    answers = {place.name: request(place, StatusRequest(), RobotStatus) for place in places}
    found = {name: status for name, status in answers.items() if status is not None}
    return found, 0 if len(found) == len(answers) else FAILED


def _as_json(name: str, status: RobotStatus, used: Usage) -> dict[str, Any]:
    from tfcompose.plan.codec import encode

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


def _colour(column: int, text: str) -> str:
    if HEAD[column] != "STATE" or text == "STATE":
        return ""
    if text == "running":
        return GREEN
    return RED if text.startswith("fatal") or text.endswith("failed") else YELLOW


def _time(seconds: float) -> str:
    total_s = int(seconds)
    if total_s < 60:  # noqa: PLR2004 (seconds of a minute)
        return f"{total_s} s"
    minutes, rest = divmod(total_s, 60)
    if minutes < 60:  # noqa: PLR2004 (minutes of an hour)
        return f"{minutes}:{rest:02d} min"
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d} h"
