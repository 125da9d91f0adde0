"""A plan that was built: read from its file, and as the command line asks for it."""

from __future__ import annotations

import os
import sys
from dataclasses import replace
from typing import TYPE_CHECKING

from tfcompose.cli.terminal import UNREADABLE, print_findings, read_text, unreadable
from tfcompose.findings import RejectedError
from tfcompose.ipc import SETTLE
from tfcompose.plan import Plan
from tfcompose.plan.file import read_plan
from tfcompose.run.hosts import share_of

if TYPE_CHECKING:
    from argparse import Namespace
    from pathlib import Path

PLAN = "plan.json"


def plan_in(file: Path) -> Plan | int:
    """Return the plan in the file, or the exit code after saying what is wrong with it."""
    try:
        return read_plan(read_text(str(file)), str(file))
    except RejectedError as error:
        print_findings(error.findings, sys.stderr)
        return UNREADABLE if unreadable(error.findings) else 1


def as_asked(plan: Plan, arguments: Namespace) -> Plan | int:
    """Return this machine's share of the plan, with what the command line says about the guard; or an exit code."""
    if arguments.guard:
        plan = replace(plan, guard=replace(plan.guard, mode=arguments.guard))
    share = share_of(plan, arguments.host, os.uname().nodename)
    if not isinstance(share, Plan):
        print_findings([share], sys.stderr)
        return 1
    plan = share
    if arguments.settle is None:
        return plan
    env = {SETTLE: str(arguments.settle)}
    processes = tuple(
        replace(process, env=process.env | env) if process.kind == "guard" else process for process in plan.processes
    )
    return replace(plan, processes=processes)
