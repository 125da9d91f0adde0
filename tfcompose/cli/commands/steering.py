"""The commands ``start``, ``stop`` and ``restart`` for processes of a running robot."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.cli.options import add_processes

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace

    from tfcompose.model.messages import Verb


class ProcessCommand:
    """A command that asks the launcher to start, stop or restart processes.

    ``help_text`` is its help.
    """

    def __init__(self, action: Verb, progress: str, help_text: str) -> None:
        self.__doc__ = help_text
        self._action, self._progress = action, progress

    @staticmethod
    def arguments(parser: ArgumentParser) -> None:
        """Add the command's arguments."""
        add_processes(parser)

    def run(self, arguments: Namespace) -> int:
        """Ask the launcher.

        Returns:
            0; 1 if it refuses or no robot runs; 2 if several robots run and none is named.
        """
        from tfcompose.cli.runs import control_processes

        return control_processes(arguments, self._action, self._progress)


START = ProcessCommand(
    "start",
    "starting",
    """Start processes that were stopped or have ended.

    Start processes of a running robot that were stopped, have ended, or wait for a restart.
""",
)
STOP = ProcessCommand(
    "stop",
    "stopping",
    """Stop processes of a running robot.

Stop processes as the plan says; they stay stopped until started again. The others keep running,
and the guard does not warn about the missing edges.
""",
)
RESTART = ProcessCommand(
    "restart",
    "restarting",
    """Restart processes of a running robot.

Stop processes as the plan says and start them again. The others keep running.
""",
)
