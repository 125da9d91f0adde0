"""What exports to supervisors share: names, what starts first, and how each process is started again."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from itertools import count
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


def plain_name(name: str) -> str:
    """Return the name with nothing that units and services may not have in theirs."""
    return _NO_NAME.sub("-", name)


def plain_names(plan: Plan) -> dict[str, str]:
    """Return the plain name of each process, by its own: no two are the same, and one that is plain stays."""
    processes = [process.name for process in plan.processes]
    names = {name: name for name in processes if plain_name(name) == name}
    for name in processes:
        if name not in names:
            plain, taken = plain_name(name), set(names.values())
            names[name] = next(one for n in count(1) if (one := f"{plain}-{n}" if n > 1 else plain) not in taken)
    return names


def command_of(process: PlanProcess, python: str, plan_file: str) -> list[str]:
    """Return the words that start the process as ``tfcompose up`` does."""
    return [python, "-m", "tfcompose.launcher.exec", plan_file, process.name]


def restart_of(process: PlanProcess) -> str:
    """Return when it is started again: tfcompose's own after each failure, for here no launcher ends everything."""
    return process.restart if process.kind == "run" else "on-failure"


def after(plan: Plan, process: PlanProcess) -> dict[str, str]:
    """Return which processes come first here, and what of them is waited for; a strict guard is among them."""
    waits = {name: what for name, what in process.after.items() if plan.process(name).kind != "external"}
    guards = [one.name for one in started(plan) if one.kind == "guard" and plan.guard.mode == "strict"]
    return dict.fromkeys(() if process.kind == "guard" else guards, "started") | waits


def gaps_of(plan: Plan) -> list[str]:
    """Return what a supervisor that knows nothing of ROS does not do of the plan, one sentence each."""
    gaps = []
    if plan.guard.on_violation != "report":
        gaps.append(f"the guard reports: nobody here follows on_violation: {plan.guard.on_violation}")
    if plan.guard.mode == "strict":
        gaps.append("the fence is one of remappings; what a sender latched before its last message ends with the guard")
    for process in plan.processes:
        if process.kind == "external":
            gaps.append(f"{process.name} is expected, not started: somebody else does")
        if process.required:
            gaps.append(f"{process.name} is required: its end does not end the others here")
    return gaps
