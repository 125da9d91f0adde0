"""``tfcompose logs``: what the processes of a robot wrote.

Print the logs, oldest line first, of a robot that runs or has run. They are kept on disk, and turned over when they
grow. The launcher's own lines are those of tfcompose.
"""

from __future__ import annotations

import os
import sys
import time
from collections import deque
from typing import TYPE_CHECKING

from tfcompose.cli.console import COLOURS
from tfcompose.cli.options import counted
from tfcompose.cli.printable import head_of, width_of
from tfcompose.cli.reader import is_read
from tfcompose.cli.running import add_robot, chosen, running
from tfcompose.cli.terminal import coloured, complain
from tfcompose.findings import did_you_mean
from tfcompose.render.text import PLAIN
from tfcompose.run.launcher.logs import Follower, last_written, logged, read_logs
from tfcompose.run.place import places

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace
    from collections.abc import Iterable

    from tfcompose.run.place import Place

#: How often the files are looked at with -f, in seconds.
LOOK_EVERY_S = 0.2


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument("name", nargs="*", metavar="NAME", help="only these processes; default: all")
    parser.add_argument("-f", "--follow", action="store_true", help="go on with what comes, until the robot ends")
    parser.add_argument("-n", "--lines", type=counted, metavar="N", help="only the last N lines")
    parser.add_argument("-t", "--times", action="store_true", help="print the time before each line")
    add_robot(parser)


def run(arguments: Namespace) -> int:
    """Print the logs; exit code 0, 1 where there are none."""
    place = _place(arguments.robot)
    if isinstance(place, int):
        return place
    known = logged(place.logs)
    for name in arguments.name:
        if name not in known:
            advice = did_you_mean(name, known, f"there are logs of {', '.join(known)}")
            complain(f"{place.name} has no log of {name}; {advice}")
            return 1
    names = arguments.name or known
    follower = Follower(place.logs, names)
    printer = _Printer(known, times=arguments.times)
    lines = read_logs(place.logs, names)
    printer.print(lines if arguments.lines is None else deque(lines, maxlen=arguments.lines))
    while arguments.follow:
        ended = place.holder() is None
        printer.print(follower.more())
        if ended:
            break
        if not is_read(sys.stdout):
            raise BrokenPipeError
        time.sleep(LOOK_EVERY_S)
    return 0


def _place(robot: str | None) -> Place | int:
    """Return the robot that runs, or the one that has run last."""
    if robot is None and len(alive := running()) == 1:
        return alive[0][0]
    there = [place for place in places(os.environ) if place.logs.is_dir()]
    if robot is None and there and not alive:
        return max(there, key=lambda place: last_written(place.logs))
    return chosen(robot, among=lambda: there)


class _Printer:
    def __init__(self, names: list[str], *, times: bool) -> None:
        self._width = width_of(names)
        colours = COLOURS if coloured(sys.stdout) else ("",)
        self._colours = {name: colours[index % len(colours)] for index, name in enumerate(names)}
        self._times = times

    def print(self, lines: Iterable[tuple[str, str, str]]) -> None:
        for at, name, text in lines:
            colour = self._colours[name]
            stamp = f"{at} " if self._times else ""
            sys.stdout.write(f"{colour}{head_of(name, self._width)}{PLAIN if colour else ''} {stamp}{text}\n")
        sys.stdout.flush()
