"""What exports to supervisors share: names, what starts first, and how each process is started again."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tfcompose.plan import Plan, PlanProcess

#: How often a process is started again in a row, where the plan leaves that to the launcher.
MAX_RESTARTS = 5
#: How long a process has to end, in seconds: SIGINT and SIGTERM, five each, in the launcher's hands.
STOP_S = 10.0

_NO_NAME = re.compile(r"[^A-Za-z0-9_.]+")


@dataclass(frozen=True, slots=True)
class Machine:
    """Where an export runs: the plan's folder there, its Python, setup files to source, variables to set, and an image.

    ``folder`` is absolute for systemd, and relative to the written file for the others.
    """

    folder: str
    python: str = "python3"
    setup: tuple[str, ...] = ()
    env: dict[str, str] = field(default_factory=dict)
    image: str = ""


def started(plan: Plan) -> list[PlanProcess]:
    """Return the processes that an export starts."""
    return [process for process in plan.processes if process.kind != "external"]


def plain_name(process: str) -> str:
    """Return the process's name with nothing that units, services or nodes may not have in theirs."""
    return _NO_NAME.sub("-", process)


def command_of(process: PlanProcess, python: str, plan_file: str) -> list[str]:
    """Return the words that start the process as ``tfcompose up`` does."""
    return [python, "-m", "tfcompose.run.process", plan_file, process.name]


def restart_of(process: PlanProcess) -> str:
    """Return when it is started again: tfcompose's own after each failure, for here no launcher ends everything."""
    return process.restart if process.kind == "run" else "on-failure"


def unkept(plan: Plan) -> list[str]:
    """Return what a supervisor without eyes on ROS does not do of the plan, one sentence each."""
    said = []
    for process in plan.processes:
        if process.kind == "external":
            said.append(f"{process.name} is expected, not started: somebody else does")
        elif process.lifecycle:
            states = ", ".join(f"{node} → {state}" for node, state in process.lifecycle.items())
            said.append(f"{process.name}: nobody drives its lifecycle ({states}); ros2 lifecycle set, or tfcompose up")
        if process.required:
            said.append(f"{process.name} is required: its end does not end the others here")
    return said
