"""Which profiles of a robot need no program that is missing here: looked for when one is missing."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.cli.compiling import library, overlays_of
from tfcompose.cli.terminal import read_text
from tfcompose.compile import compile_robot
from tfcompose.emit.plan import plan_of
from tfcompose.findings import RejectedError
from tfcompose.language import with_includes
from tfcompose.load import load
from tfcompose.ros.environment import child_environment
from tfcompose.run.launcher.preflight import commands_of, started_by_us

if TYPE_CHECKING:
    from argparse import Namespace


def profiles_that_start(arguments: Namespace) -> list[str]:
    """Return the profiles with which, laid over those that were asked for, every program is there."""
    try:
        written = with_includes(load(read_text(arguments.file), arguments.file), read_text).data
        profiles = written.get("profiles", {}) if isinstance(written, dict) else {}
        return [name for name in profiles if name not in arguments.profiles and _starts(name, arguments)]
    except RejectedError:
        return []


def _starts(profile: str, arguments: Namespace) -> bool:
    profiles, overlays = [*arguments.profiles, profile], overlays_of(arguments)
    file, presets = arguments.file, library()
    compiled = compile_robot(read_text(file), file, presets, profiles, overlays=overlays, read=read_text)
    if compiled.robot is None or compiled.errors:
        return False
    plan = plan_of(compiled.robot)
    return not commands_of(plan, started_by_us(plan), Path(file), os.environ, child_environment)[1]
