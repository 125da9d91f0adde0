"""The verb ``ros2 tfcompose``, which runs every command of tfcompose.

``ros2`` finds the verb in the entry-point group ``ros2cli.command``. The verb replaces the process
of ``ros2`` by tfcompose. Therefore the options, help, completion, exit code, signals and memory of
a command are the same as with ``tfcompose COMMAND``.
"""

from __future__ import annotations

import os
import re
import sys
from argparse import REMAINDER
from typing import TYPE_CHECKING, NoReturn

from ros2cli.command import CommandExtension

from tfcompose.launcher.program import HERE

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace
    from collections.abc import Mapping

#: The command line before the verb: ``ros2`` and its options.
_BEFORE_VERB = re.compile(r"\s*\S+\s+(?:-\S+\s+)*(?=tfcompose\s)")


class TfComposeCommand(CommandExtension):  # type: ignore[misc] # ROS has no types
    """Check, build, start and guard a robot's TF tree."""

    def add_arguments(self, parser: ArgumentParser, _cli_name: str) -> None:
        """Accept all arguments after the verb without parsing; complete them if a shell asks."""
        if "_ARGCOMPLETE" in os.environ:
            _become_tfcompose([], os.environ | _completion_without_ros2(os.environ))
        parser.prefix_chars = ""  # no argument is an option of ros2, not even --help
        parser.add_argument("argv", nargs=REMAINDER)

    def main(self, *, parser: ArgumentParser, args: Namespace) -> NoReturn:  # noqa: ARG002 (ros2cli's)
        """Run the command in this process."""
        _become_tfcompose(args.argv, os.environ)


def _become_tfcompose(argv: list[str], env: Mapping[str, str]) -> NoReturn:
    sys.stdout.flush()
    sys.stderr.flush()
    os.execve(HERE[0], [*HERE, *argv], dict(env))  # noqa: S606 (without a shell)


def _completion_without_ros2(env: Mapping[str, str]) -> dict[str, str]:
    """Return argcomplete's variables for a command line that begins with the verb."""
    line, point = env["COMP_LINE"], int(env["COMP_POINT"])
    before = _BEFORE_VERB.match(line)
    start = before.end() if before else 0
    return {
        "COMP_LINE": line[start:],
        "COMP_POINT": str(point - len(line[:start].encode())),  # the shell counts bytes
    }
