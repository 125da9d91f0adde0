"""Check whether this machine could start its share: ``tfcompose rehearse PLAN HOST``.

Before a deployment changes anything on a host, it runs this program there with the environment of
the systemd unit. The program prints its findings as a line of JSON.
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.foundation.findings import Finding, RejectedError
from tfcompose.launcher.preflight import commands_of
from tfcompose.model.plan.file import read_plan
from tfcompose.model.plan.hosts import share_of
from tfcompose.tf.ros.environment import child_environment, ros_trouble

if TYPE_CHECKING:
    from collections.abc import Sequence


def hindrances(file: Path, host: str) -> list[Finding]:
    """Return findings that prevent the host's share of the plan from starting here."""
    try:
        plan = read_plan(file.read_text("utf-8"), file.name)
    except RejectedError as error:
        return list(error.findings)
    share = share_of(plan, host, "")
    if isinstance(share, Finding):
        return [share]
    trouble = ros_trouble(child_environment(os.environ, share.ros, is_built_in=True), share.ros)
    return (
        [trouble]
        if trouble
        else commands_of(share, share.managed, file, os.environ, child_environment)[1]
    )


def main(argv: Sequence[str]) -> int:
    """Print findings that prevent the share of HOST in PLAN_FILE from starting here; return 0."""
    file, host = argv
    findings = [
        {"code": finding.code, "message": finding.message, "help": finding.help}
        for finding in hindrances(Path(file), host)
    ]
    sys.stdout.write(f"{json.dumps(findings)}\n")
    return 0
