"""Wait until a running robot has ended, or is ready.

Wait until the robot has ended, and return its exit code. With --ready, wait until every process
is ready, every edge is live and the guard sees no error. After the timeout, report missing edges,
processes and errors.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.cli.options import add_robot, positive
from tfcompose.cli.terminal import FAILED, warn

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    add_robot(parser)
    parser.add_argument(
        "--ready",
        action="store_true",
        help="wait until every process is ready, every edge is live, and there is no error",
    )
    parser.add_argument("--timeout", type=positive, metavar="S", help="exit 1 after S seconds")


def run(arguments: Namespace) -> int:
    """Wait. Return the exit code of the robot, or 0 when the robot is ready.

    Return 1 after the timeout, or if no robot runs.
    """
    from tfcompose.cli.runs import chosen_run, notices, wait_until_ready
    from tfcompose.model.messages import Ended

    runtime_dir = chosen_run(arguments.robot, "wait")
    if arguments.ready:
        return wait_until_ready(runtime_dir, arguments.timeout, without_errors=True)
    try:
        for notice, _ in notices(runtime_dir, arguments.timeout):
            if isinstance(notice, Ended):
                return notice.exit_code
    except TimeoutError:
        warn(f"{runtime_dir.name} still runs after {arguments.timeout:g} s")
    except OSError as error:
        warn(f"{runtime_dir.name} does not answer: {error}")
    else:
        warn(f"{runtime_dir.name} was killed")
    return FAILED
