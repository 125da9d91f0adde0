"""The command line: the only part that reads files, writes files, prints and exits.

``parser`` finds the command, ``commands`` has one module for each; code shared by several commands
is here. A command imports heavy modules in its ``run``. Must not import ``tools``, ``rclpy``,
``yaml``: tools bring their own commands.
"""

from __future__ import annotations


def main(argv: list[str] | None = None) -> int:
    """Run the command line and return the exit code."""
    try:
        from tfcompose.cli import (
            parser,  # imported here, so that Ctrl-C during the import ends without a traceback
        )
    except KeyboardInterrupt:
        return 130  # the exit code of a shell for a program that Ctrl-C ended
    return parser.main(argv)
