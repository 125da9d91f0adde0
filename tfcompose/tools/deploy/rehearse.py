"""Whether a plan's share could be started on this machine: ``python -m tfcompose.tools.deploy.rehearse PLAN HOST``.

The agent runs it on a host, with the environment that the unit has, before anything changes. It
prints the findings as one line of JSON.
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path

from tfcompose.foundation.findings import Finding, RejectedError
from tfcompose.launcher.preflight import commands_of
from tfcompose.model.plan.file import read_plan
from tfcompose.model.plan.hosts import share_of
from tfcompose.tf.ros.environment import child_environment, ros_trouble


def hindrances(file: Path, host: str) -> list[Finding]:
    """Return what keeps the host's share of the plan from being started here."""
    try:
        plan = read_plan(file.read_text("utf-8"), file.name)
    except RejectedError as error:
        return list(error.findings)
    share = share_of(plan, host, "")
    if isinstance(share, Finding):
        return [share]
    trouble = ros_trouble(child_environment(os.environ, share.ros, own=True), share.ros)
    return (
        [trouble]
        if trouble
        else commands_of(share, share.managed, file, os.environ, child_environment)[1]
    )


if __name__ == "__main__":
    found = hindrances(Path(sys.argv[1]), sys.argv[2])
    sys.stdout.write(
        json.dumps([{"code": one.code, "message": one.message, "help": one.help} for one in found])
        + "\n"
    )
