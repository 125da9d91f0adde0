"""``tfcompose wait``: wait until a running robot has ended.

Wait until the robot has ended, and return its exit code; --ready waits until every process is ready and every edge
live instead, and says what is missing when the time is over.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.cli.missing import until_ready
from tfcompose.cli.options import positive
from tfcompose.cli.running import add_robot, chosen, events
from tfcompose.cli.terminal import complain
from tfcompose.ipc import Ended

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace

    from tfcompose.run.place import Place


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    add_robot(parser)
    parser.add_argument("--ready", action="store_true", help="until every process is ready and every edge live")
    parser.add_argument("--timeout", type=positive, metavar="S", help="wait so long at most; then exit code 1")


def run(arguments: Namespace) -> int:
    """Wait; exit code of the robot, or 0 when it is ready; 1 when the time is over or none runs."""
    place = chosen(arguments.robot)
    if isinstance(place, int):
        return place
    if arguments.ready:
        return until_ready(place, arguments.timeout)
    try:
        return _ended(place, arguments.timeout)
    except TimeoutError:
        complain(f"{place.name} still runs after {arguments.timeout:g} s")
    except OSError as error:
        complain(f"{place.name} does not answer: {error}")
    return 1


def _ended(place: Place, timeout_s: float | None) -> int:
    for notice, _ in events(place, timeout_s):
        if isinstance(notice, Ended):
            return notice.exit_code
    complain(f"{place.name} was killed")
    return 1
