"""Check of what sharing edges with a fleet needs."""

from __future__ import annotations

from importlib.util import find_spec
from typing import TYPE_CHECKING

from tfcompose.foundation.findings import Finding, finding
from tfcompose.model.plan import PROGRAM

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model.plan import Plan

#: The command of a process that shares edges begins with this.
SHARE_COMMAND = (PROGRAM, "fleet", "share")
#: What installs what it needs.
INSTALL = "pip install 'tfcompose[fleet]'"


def missing_zenoh(plan: Plan) -> Iterator[Finding]:
    """Yield a finding for each process of the plan that this Python cannot share edges with."""
    for process in plan.managed if find_spec("zenoh") is None else ():
        if process.argv[:3] == SHARE_COMMAND:
            yield finding(
                "TF920",
                f"{process.name} needs eclipse-zenoh, which is not installed",
                None,
                help=f"{INSTALL}, or take fleet out of the robot file",
            )
