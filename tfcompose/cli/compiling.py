"""What the commands that take a robot file share: presets from the package, and one compiled robot."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.cli.terminal import UNREADABLE, print_findings, read_text, unreadable
from tfcompose.compile import compile_robot
from tfcompose.diagnostic import RejectedError
from tfcompose.resolve import Library

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tfcompose.model import Robot


PRESETS = Path(__file__).parent.parent / "presets"


def library() -> Library:
    """Return the presets that come with tfcompose."""
    known = {preset.relative_to(PRESETS).with_suffix("").as_posix(): preset for preset in PRESETS.glob("*/*.yaml")}
    return Library(tuple(sorted(known)), lambda name: (known[name].read_text("utf-8"), f"presets/{name}.yaml"))


def robot_or_code(file: str, profiles: Sequence[str]) -> Robot | int:
    """Return the robot without errors in it, or the exit code after printing what is wrong. Warnings are printed."""
    try:
        compiled = compile_robot(read_text(file), file, library(), profiles)
        found = compiled.found
    except RejectedError as error:
        compiled, found = None, error.diagnostics
    print_findings(found, sys.stderr)
    if compiled is None or compiled.robot is None or compiled.errors:
        return UNREADABLE if unreadable(found) else 1
    return compiled.robot
