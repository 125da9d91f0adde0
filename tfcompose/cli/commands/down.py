"""``tfcompose down``: stop a running robot.

Stop everything, in reverse order of the start, and wait until it has ended. --leftovers stops what an earlier run of
the robot left behind instead, if anything did.
"""

from __future__ import annotations

import os
import sys
from typing import TYPE_CHECKING

from tfcompose.cli.options import positive
from tfcompose.cli.running import add_robot, asked, chosen, events, told
from tfcompose.cli.terminal import complain
from tfcompose.ipc import Done, DownRequest, Ended
from tfcompose.run.launcher.leftovers import end, leftovers
from tfcompose.run.place import places

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace

    from tfcompose.run.launcher.leftovers import Leftover
    from tfcompose.run.place import Place


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    add_robot(parser)
    parser.add_argument("--timeout", type=positive, default=60.0, metavar="S", help="wait so long; default: 60")
    parser.add_argument("--leftovers", action="store_true", help="stop what earlier runs left behind")


def run(arguments: Namespace) -> int:
    """Stop it; exit code 0 when it has ended, 1 where none runs or it does not end in time."""
    if arguments.leftovers:
        return _leftovers(arguments.robot)
    place = chosen(arguments.robot)
    if isinstance(place, int):
        return place
    answer = asked(place, DownRequest(), Done)
    if isinstance(answer, int):
        return answer
    try:
        for notice, _ in events(place, arguments.timeout):
            if isinstance(notice, Ended):
                break
    except TimeoutError:
        complain(f"{place.name} has not ended after {arguments.timeout:g} s; tfcompose ps says what still runs")
        return 1
    except OSError:
        pass  # it has ended already
    return told(f"{place.name} has ended")


def _leftovers(robot: str | None) -> int:
    place = chosen(robot, among=lambda: places(os.environ))
    if isinstance(place, int):
        return place
    found = _left_by(place)
    for one in found:
        sys.stdout.write(f"stopping {one.pid}: {one.command}\n")
    rest = end(found)
    for one in rest:
        complain(f"{one.pid} is still there: {one.command}")
    return 1 if rest else told(f"{len(found)} process{'' if len(found) == 1 else 'es'} of earlier runs stopped")


def _left_by(place: Place) -> list[Leftover]:
    return [one for one in leftovers(f"{place.name}:") if one.launcher is None]
