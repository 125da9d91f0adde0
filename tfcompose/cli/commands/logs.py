"""Print the logs of a robot's processes, also after its end.

Print the logs of the current run, or of the last run if the robot has ended, oldest line first.
Logs of earlier runs are kept too, and rotated. The launcher's own lines have the name tfcompose.
"""

from __future__ import annotations

import math
import os
import re
import shlex
import sys
import time
from argparse import ArgumentTypeError
from collections import deque
from datetime import datetime
from typing import TYPE_CHECKING

from tfcompose.cli.options import add_robot, count
from tfcompose.cli.terminal import UNREADABLE, fail, has_reader, is_coloured
from tfcompose.compiler.render.text import PLAIN

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace
    from collections.abc import Iterable

    from tfcompose.launcher.runtime_dir import RuntimeDir

#: Interval between the reads of the files with -f, in seconds.
READ_EVERY_S = 0.2


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument(
        "name", nargs="*", metavar="NAME", help="only these processes; default: all"
    )
    parser.add_argument(
        "-f",
        "--follow",
        action="store_true",
        help="print new lines as they come, until the robot ends",
    )
    parser.add_argument("-n", "--lines", type=count, metavar="N", help="only the last N lines")
    parser.add_argument(
        "-t", "--times", action="store_true", help="print the time before each line"
    )
    past = parser.add_mutually_exclusive_group()
    past.add_argument(
        "--since",
        type=since,
        metavar="TIME",
        help="begin this long ago (90s, 10m, 2h, 3d) or at this time (14:03, 2026-11-26T14:03), "
        "also in earlier runs",
    )
    past.add_argument("--previous", action="store_true", help="print the run before this one")
    add_robot(parser)


_AGO = re.compile(r"(\d+(?:\.\d+)?)\s*(s|min|m|h|d)")
_UNIT_S = {"s": 1, "m": 60, "min": 60, "h": 3600, "d": 86400}


def since(text: str) -> float:
    """Parse a duration before now, or a local time. Return seconds since 1970.

    Raises:
        ArgumentTypeError: if the text is neither.
    """
    if ago := _AGO.fullmatch(text):
        return time.time() - float(ago[1]) * _UNIT_S[ago[2]]
    try:
        stamp = f"{time.strftime('%Y-%m-%d')}T{text:>05}" if ":" in text[:3] else text
        return datetime.fromisoformat(stamp).timestamp()
    except ValueError:
        raise ArgumentTypeError(
            f"{text} is not a time, such as 10m, 14:03 or 2026-11-26"
        ) from None


def run(arguments: Namespace) -> int:
    """Print the logs. Return 0, or 1 if there are no logs."""
    from tfcompose.foundation.findings import did_you_mean
    from tfcompose.launcher.output import Follower, logged_processes, read_logs, runs_of

    runtime_dir = _runtime_dir(arguments.robot, shlex.join(["logs", *arguments.name]))
    processes = logged_processes(runtime_dir.logs)
    for name in arguments.name:
        if name not in processes:
            advice = did_you_mean(name, processes, f"it has logs of {', '.join(processes)}")
            fail(f"{runtime_dir.name} has no log of {name}; {advice}")
    names = arguments.name or processes
    if arguments.previous and arguments.follow:
        fail("--previous prints a run that has ended: leave out --follow", UNREADABLE)
    *earlier, begin_s = [0.0, *runs_of(runtime_dir.logs)]
    end_s = math.inf
    if arguments.previous:
        if not any(earlier):
            fail(f"no run of {runtime_dir.name} before this one is recorded")
        begin_s, end_s = earlier[-1], begin_s
    elif arguments.since is not None:
        begin_s = arguments.since
    follower = Follower(runtime_dir.logs, names)
    printer = _LogPrinter(processes, names, times=arguments.times)
    lines = read_logs(runtime_dir.logs, names, begin_s, end_s)
    printer.print(lines if arguments.lines is None else deque(lines, maxlen=arguments.lines))
    while arguments.follow:
        ended = runtime_dir.holder() is None
        printer.print(follower.more())
        if ended:
            break
        if not has_reader(sys.stdout):
            raise BrokenPipeError
        time.sleep(READ_EVERY_S)
    return 0


def _runtime_dir(robot: str | None, command: str) -> RuntimeDir:
    """Return the folder of the selected robot that runs, or else that ran last.

    ``robot`` selects robots by name. None selects the robots of this shell (``in_scope``).
    """
    from tfcompose.cli.runs import chosen_run, in_scope, is_meant
    from tfcompose.foundation.reading import is_folder
    from tfcompose.launcher.output import last_modified
    from tfcompose.launcher.runtime_dir import runtime_dirs

    with_logs = [
        runtime_dir for runtime_dir in runtime_dirs(os.environ) if is_folder(runtime_dir.logs)
    ]
    matching = (
        [runtime_dir for runtime_dir in with_logs if is_meant(runtime_dir, robot)]
        if robot
        else in_scope(with_logs)
    )
    running = [runtime_dir for runtime_dir in matching if runtime_dir.holder()]
    if matching and len(running) <= 1:
        return (
            running[0]
            if running
            else max(matching, key=lambda runtime_dir: last_modified(runtime_dir.logs))
        )
    return chosen_run(robot, command, among=lambda: running or with_logs)


class _LogPrinter:
    def __init__(self, processes: list[str], names: list[str], *, times: bool) -> None:
        from tfcompose.cli.console import COLOURS, prefix_of

        width = max(map(len, names), default=0)
        colours = COLOURS if is_coloured(sys.stdout) else ("",)
        ends = PLAIN if is_coloured(sys.stdout) else ""
        self._prefixes = {
            name: f"{colours[index % len(colours)]}{prefix_of(name, width)}{ends}"
            for index, name in enumerate(processes)
        }
        self._times = times

    def print(self, lines: Iterable[tuple[str, str, str]]) -> None:
        for time_text, name, text in lines:
            stamp = f"{time_text} " if self._times else ""
            sys.stdout.write(f"{self._prefixes[name]} {stamp}{text}\n")
        sys.stdout.flush()
