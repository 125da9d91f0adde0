"""What the commands that take a robot file share: presets from the package, and one compiled robot."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from tfcompose.cli.disk import disk
from tfcompose.cli.shelves import library
from tfcompose.cli.terminal import UNREADABLE, print_findings, read_text, unreadable
from tfcompose.compile import compile_robot
from tfcompose.findings import RejectedError
from tfcompose.language import set_value, with_includes
from tfcompose.load import load

if TYPE_CHECKING:
    from argparse import Namespace

    from tfcompose.load import Source
    from tfcompose.model import Robot


__all__ = ["library", "overlays_of", "robot_or_code"]


def overlays_of(arguments: Namespace) -> list[Source]:
    """Return what --overlay and --set lay over a robot, in that order.

    Raises:
        RejectedError: if a file cannot be read or is not YAML, or a setting is not one.
    """
    files = [with_includes(load(read_text(file), file), read_text) for file in arguments.overlays]
    return [*files, *(set_value(setting) for setting in arguments.settings)]


def robot_or_code(file: str, arguments: Namespace) -> Robot | int:
    """Return the robot without errors in it, or the exit code after printing what is wrong. Warnings are printed."""
    made = sources_and_robot(file, arguments)
    return made if isinstance(made, int) else made[1]


def sources_and_robot(file: str, arguments: Namespace) -> tuple[tuple[Source, ...], Robot] | int:
    """Return what ``robot_or_code`` does, with what it was made from: files with overlays laid over them, parts too."""
    compiled = None
    try:
        overlays = overlays_of(arguments)
        compiled = compile_robot(
            read_text(file), file, library(), arguments.profiles, overlays=overlays, read=read_text, disk=disk()
        )
        found = compiled.found
    except RejectedError as error:
        found = error.findings
    print_findings(found, sys.stderr)
    if compiled is None or compiled.robot is None or compiled.errors:
        return UNREADABLE if unreadable(found) else 1
    return compiled.sources, compiled.robot
