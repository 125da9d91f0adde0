"""``tfcompose events``: what happens in a running robot.

Print what the launcher has told since the start, and then each event as it comes, until the robot ends.
"""

from __future__ import annotations

import sys
import time
from typing import TYPE_CHECKING

from tfcompose.cli.console import Console
from tfcompose.cli.running import add_robot, chosen, events
from tfcompose.cli.terminal import coloured, complain
from tfcompose.ipc import Ended, notice_line
from tfcompose.plan import Plan, RosSettings

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace

    from tfcompose.run.place import Place


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    add_robot(parser)
    parser.add_argument("--format", choices=("text", "json"), default="text", help="json: one object a line")


def run(arguments: Namespace) -> int:
    """Print events until the robot ends; exit code 0, 1 where none runs, or it is heard no more before it ends."""
    place = chosen(arguments.robot)
    if isinstance(place, int):
        return place
    lines = _Timed()
    ended = False
    console = Console(Plan(place.name, "", None, RosSettings(), (), ()), lines, colour=coloured(sys.stdout))
    try:
        for notice, at in events(place, for_whom=sys.stdout):
            ended = isinstance(notice, Ended)
            if arguments.format == "json":
                sys.stdout.write(f"{notice_line(notice, at)}\n")
            else:
                lines.at = at
                console(notice)
            sys.stdout.flush()
    except BrokenPipeError:
        raise
    except OSError as error:
        complain(f"{place.name} does not answer: {error}")
        return 1
    if not ended:
        slow = "tells more than was read here, and did not wait; ask again"
        complain(f"{place.name} {slow if _is_held(place) else 'was killed'}")
    return 0 if ended else 1


def _is_held(place: Place) -> bool:
    """Return whether the robot still runs; one that ends hangs up a moment before it gives its lock back."""
    for _ in range(40):
        if place.holder() is None:
            return False
        time.sleep(0.05)
    return True


class _Timed:
    """Standard output, with the time before each line."""

    at = 0.0

    def write(self, text: str, *, log: bool = False) -> None:
        """Write a line."""
        del log
        stamp = time.strftime("%H:%M:%S", time.localtime(self.at))
        sys.stdout.write(f"{stamp}.{int(self.at * 1000) % 1000:03d} {text}")
