"""Print past events of a running robot, then follow.

Print all events since the start, then new events until the robot ends.
"""

from __future__ import annotations

import sys
import time
from typing import TYPE_CHECKING

from tfcompose.cli.options import add_format, add_robot
from tfcompose.cli.terminal import FAILED, code_addresses, fail, is_coloured, warn

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace

    from tfcompose.launcher.runtime_dir import RuntimeDir


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    add_robot(parser)
    add_format(parser, text="json: one object per line; default: text")


def run(arguments: Namespace) -> int:
    """Print events until the robot ends.

    Return 0; 1 if no robot runs, or if the connection is lost before the robot ends.
    """
    from tfcompose.cli.console import Console
    from tfcompose.cli.runs import chosen_run, notices
    from tfcompose.model.messages import Ended, notice_line
    from tfcompose.model.plan import Plan, RosSettings

    runtime_dir = chosen_run(arguments.robot, "events")
    lines = _TimedLines()
    ended = False
    console = Console(
        Plan(runtime_dir.name, "", None, ros=RosSettings(), edges=(), processes=()),
        lines,
        colour=is_coloured(sys.stdout),
        address_of=code_addresses(sys.stdout),
    )
    try:
        for notice, time_s in notices(runtime_dir, output=sys.stdout):
            ended = isinstance(notice, Ended)
            if arguments.format == "json":
                print(notice_line(notice, time_s))
            else:
                lines.time_s = time_s
                console(notice)
            sys.stdout.flush()
    except BrokenPipeError:
        raise
    except OSError as error:
        fail(f"{runtime_dir.name} does not answer: {error}")
    if ended:
        return 0
    slow = "reports faster than this terminal reads; run events again"
    warn(f"{runtime_dir.name} {slow if _is_held(runtime_dir) else 'was killed'}")
    return FAILED


def _is_held(runtime_dir: RuntimeDir) -> bool:
    """Return whether the robot still runs.

    At its end, a robot closes the connection a moment before it releases its lock.
    """
    for _ in range(40):
        if runtime_dir.holder() is None:
            return False
        time.sleep(0.05)
    return True


class _TimedLines:
    """Writes lines to standard output, each after its time."""

    time_s = 0.0

    def write(self, text: str, *, log: bool = False) -> None:
        """Write a line."""
        del log
        stamp = time.strftime("%H:%M:%S", time.localtime(self.time_s))
        sys.stdout.write(f"{stamp}.{int(self.time_s * 1000) % 1000:03d} {text}")
