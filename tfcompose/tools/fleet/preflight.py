"""Check before the start that eclipse-zenoh is installed."""

from __future__ import annotations

from importlib.util import find_spec
from typing import TYPE_CHECKING

from tfcompose.foundation.findings import Finding, finding
from tfcompose.model.plan import PROGRAM

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model.plan import Plan

#: The beginning of the command line of a process that shares edges.
SHARE_COMMAND = (PROGRAM, "fleet", "share")
#: The command that installs eclipse-zenoh.
INSTALL = "pip install 'tfcompose[fleet]'"


def missing_zenoh(plan: Plan) -> Iterator[Finding]:
    """Yield a finding for each process that needs eclipse-zenoh, if it is not installed."""
    for process in plan.managed if find_spec("zenoh") is None else ():
        if process.argv[:3] == SHARE_COMMAND:
            yield finding(
                "TF920",
                f"{process.name} needs eclipse-zenoh, which is not installed",
                None,
                help=f"{INSTALL}, or take fleet out of the robot file",
            )
