"""What the launcher answers to other commands."""

from __future__ import annotations

import os
import time
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.findings import RejectedError
from tfcompose.ipc import (
    Done,
    DownRequest,
    PlanChange,
    ProcessRequest,
    ProcessStatus,
    Refusal,
    RobotStatus,
    UpdateRequest,
)
from tfcompose.plan.file import read_plan
from tfcompose.run.launcher.gates import is_ready, waits_for
from tfcompose.run.launcher.happening import NewPlan
from tfcompose.run.launcher.lives import refusal
from tfcompose.run.launcher.preflight import commands_of, started_by_us
from tfcompose.run.launcher.prerequisites import unmet_in_words
from tfcompose.run.launcher.replan import change

if TYPE_CHECKING:
    from collections.abc import Mapping

    from tfcompose.ipc import Request
    from tfcompose.run.launcher.command import Command
    from tfcompose.run.launcher.happening import Event
    from tfcompose.run.launcher.preflight import Environment
    from tfcompose.run.launcher.state import State, Tracked


Answer = RobotStatus | Done | PlanChange | Refusal
#: The answer, what it means for the machine, and another plan's file and commands.
Outcome = tuple[Answer, "Event | None", "tuple[Path, dict[str, Command]] | None"]


def status(state: State, now: float) -> RobotStatus:
    """Return all that is known of a run."""
    return RobotStatus(
        robot=state.plan.robot,
        host=state.plan.host,
        launcher=os.getpid(),
        plan=state.plan.spec_digest,
        uptime=round(now - (state.begun or now), 3),
        complete=state.complete and not state.silent,
        ready=is_ready(state),
        stopping=state.stop is not None,
        missing=tuple(edge.name for edge in state.missing),
        silent=tuple(edge.name for edge in state.plan.edges if edge.child in state.silent & state.live),
        processes=tuple(_process(state, one, now) for one in state.tracked.values()),
    )


def _process(state: State, one: Tracked, now: float) -> ProcessStatus:
    owned = [child for _, child in one.process.owns]
    return ProcessStatus(
        name=one.process.name,
        kind=one.process.kind,
        host=one.process.host,
        state=one.state,
        detail=one.detail,
        required=one.process.required,
        failed=bool(one.failed) or one.state == "FATAL",
        ready=one.ready,
        waits=waits_for(state, one),
        seen=one.seen,
        pid=one.pid,
        uptime=round(now - one.began, 3) if one.state in ("RUNNING", "STOPPING") else None,
        restarts=one.restarts,
        edges=len(owned),
        live=sum(child in state.live and child not in state.silent for child in owned),
        nodes=one.process.nodes,
    )


def answer(
    request: Request, state: State, plan_file: Path, base: Mapping[str, str], environment: Environment
) -> Outcome:
    """Return the answer, what it means for the machine, and, for another plan, its file and commands."""
    match request:
        case DownRequest():
            return Done(), request, None
        case ProcessRequest(verb, name):
            if why := refusal(state, name, verb):
                return Refusal(why), None, None
            waits = "" if verb == "stop" else unmet_in_words(state, state.tracked[name])
            return Done(waits=waits), request, None
        case UpdateRequest():
            return _update(request, state, plan_file, base, environment)
        case _:
            return status(state, time.monotonic()), None, None


def _update(
    request: UpdateRequest, state: State, plan_file: Path, base: Mapping[str, str], environment: Environment
) -> Outcome:
    file = Path(request.plan)
    try:
        plan = read_plan(file.read_text("utf-8"), str(file))
    except (OSError, RejectedError) as error:
        return Refusal(f"{file} cannot be used: {error}"), None, None
    if state.stop:
        return Refusal("everything is being stopped"), None, None
    commands, found = commands_of(plan, started_by_us(plan), file, base, environment, Path(request.base))
    if found:
        return Refusal("; ".join(one.message for one in found)), None, None
    different = change(state.plan, plan_file.parent, plan, file.parent)
    names, before = [process.name for process in plan.processes], [process.name for process in state.plan.processes]
    said = PlanChange(
        changed=tuple(name for name in names if name in different.changed),
        added=tuple(name for name in names if name not in before),
        removed=tuple(name for name in before if name not in names),
        held=different.held,
    )
    if not any((said.changed, said.added, said.removed, said.held)):
        return said, None, None
    return said, NewPlan(plan, different.changed, different.held), (file, commands)
