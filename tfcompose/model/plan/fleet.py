"""The process that shares a robot's edges with its fleet, and its requirements."""

from __future__ import annotations

from importlib.util import find_spec
from typing import TYPE_CHECKING

from tfcompose.foundation.findings import Finding, finding
from tfcompose.model.plan.plan import PROGRAM

if TYPE_CHECKING:
    from tfcompose.model.plan.plan import PlanProcess

#: What the command of tfcompose's own sharing begins with.
SHARE_COMMAND = (PROGRAM, "fleet", "share")
#: What installs what it needs.
INSTALL = "pip install 'tfcompose[fleet]'"


def is_fleet_share(process: PlanProcess) -> bool:
    """Return whether a process shares the robot's edges, and is tfcompose's own.

    It needs eclipse-zenoh.
    """
    return process.argv[: len(SHARE_COMMAND)] == SHARE_COMMAND


def missing_zenoh(process: PlanProcess) -> Finding | None:
    """Return the finding that this Python cannot share edges, or None."""
    if not is_fleet_share(process) or find_spec("zenoh") is not None:
        return None
    message = f"{process.name} needs eclipse-zenoh, which is not installed"
    return finding("TF920", message, None, help=f"{INSTALL}, or take fleet out of the robot file")
