"""Stop a running robot.

Stop the robot's processes in reverse order, and wait until they have ended. With --leftovers,
stop processes that an earlier run left behind.
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from tfcompose.cli.options import add_robot, positive
from tfcompose.cli.terminal import FAILED, fail, warn

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    add_robot(parser)
    parser.add_argument(
        "--timeout",
        type=positive,
        default=60.0,
        metavar="S",
        help="wait at most S seconds; default: 60",
    )
    parser.add_argument(
        "--leftovers", action="store_true", help="stop processes that earlier runs left behind"
    )


def run(arguments: Namespace) -> int:
    """Stop the robot; exit code 0 once it has ended, 1 if none runs or it does not end in time."""
    from tfcompose.cli.runs import chosen_run, notices, request
    from tfcompose.model.messages import Done, DownRequest, Ended

    if arguments.leftovers:
        return _stop_leftovers(arguments.robot)
    runtime_dir = chosen_run(arguments.robot, "down")
    if request(runtime_dir, DownRequest(), Done) is None:
        return FAILED
    try:
        for notice, _ in notices(runtime_dir, arguments.timeout):
            if isinstance(notice, Ended):
                break
    except TimeoutError:
        fail(
            f"{runtime_dir.name} has not ended after {arguments.timeout:g} s; tfcompose ps lists"
            " what still runs"
        )
    except OSError:
        pass  # it has ended already
    print(f"{runtime_dir.name} has ended")
    return 0


def _stop_leftovers(robot: str | None) -> int:
    from tfcompose.cli.runs import chosen_run
    from tfcompose.launcher.leftovers import end, leftovers
    from tfcompose.launcher.runtime_dir import runtime_dirs

    runtime_dir = chosen_run(robot, "down --leftovers", among=lambda: runtime_dirs(os.environ))
    remaining = [
        leftover for leftover in leftovers(f"{runtime_dir.name}:") if leftover.launcher is None
    ]
    for leftover in remaining:
        print(f"stopping {leftover.pid}: {leftover.command}")
    rest = end(remaining)
    for leftover in rest:
        warn(f"{leftover.pid} is still running: {leftover.command}")
    if rest:
        return FAILED
    print(f"{len(remaining)} process{'' if len(remaining) == 1 else 'es'} of earlier runs stopped")
    return 0
