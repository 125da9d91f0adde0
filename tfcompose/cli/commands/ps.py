"""List the processes of running robots.

Show state, PID, uptime, restarts, CPU and memory (PSS of the process group) of each process, and
how many of its edges are live.
"""

from __future__ import annotations

import json
import sys
from typing import TYPE_CHECKING, Any

from tfcompose.cli.options import add_format, add_robot
from tfcompose.cli.terminal import FAILED, UNREADABLE, coloured, fail, table_width

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace

    from tfcompose.cli.process_table import Usage
    from tfcompose.model.messages import RobotStatus


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    add_robot(parser, "all of this user")
    add_format(parser)


def run(arguments: Namespace) -> int:
    """Print the table; exit code 0, 1 where no robot runs."""
    from tfcompose.cli.process_table import HEAD, TABLE, row, uptime
    from tfcompose.launcher.procfs import usage_of

    robots, code = _robots(arguments.robot)
    used = usage_of(
        [process.pid for status in robots.values() for process in status.processes if process.pid]
    )
    if arguments.format == "json":
        print(
            json.dumps([_as_json(name, status, used) for name, status in robots.items()], indent=1)
        )
        return code if robots else FAILED
    if not robots and not code:
        fail(
            "no robot is running"
            if arguments.robot is None
            else f"{arguments.robot} is not running"
        )
    for name, status in robots.items():
        state = (
            "stopping"
            if status.stopping
            else "tree complete"
            if status.complete
            else "tree not complete"
        )
        failed = [process.name for process in status.processes if process.failed]
        state += f", without {', '.join(failed)}" if failed else ""
        print(f"{name}: {state}, launcher {status.launcher}, since {uptime(status.uptime)}")
        rows = [HEAD, *(row(process, used) for process in status.processes)]
        print(
            *TABLE.lines(
                rows, table_width(sys.stdout), coloured=coloured(sys.stdout), indent="  "
            ),
            sep="\n",
        )
    return code


def _robots(name: str | None) -> tuple[dict[str, RobotStatus], int]:
    """Return those that answer, by their names, and the exit code: 1 after saying who does not."""
    from tfcompose.cli.runs import is_meant, request, running
    from tfcompose.launcher.runtime_dir import RuntimeDirError
    from tfcompose.model.messages import RobotStatus, StatusRequest

    try:
        places = [place for place, _ in running() if name is None or is_meant(place, name)]
    except RuntimeDirError as error:
        fail(str(error), UNREADABLE)
    answers = {place.name: request(place, StatusRequest(), RobotStatus) for place in places}
    found = {name: status for name, status in answers.items() if status is not None}
    return found, 0 if len(found) == len(answers) else FAILED


def _as_json(name: str, status: RobotStatus, used: Usage) -> dict[str, Any]:
    from tfcompose.model.plan.codec import encode

    data: dict[str, Any] = {"name": name} | encode(status)
    for process in data["processes"]:
        cpu, memory = used.get(process["pid"], (None, None))
        process |= {"cpu": cpu, "memory": memory}
    return data
