"""Answers of the launcher to other commands, and the effects of a changed plan on a run."""

from __future__ import annotations

import os
import re
import stat
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.foundation.findings import RejectedError
from tfcompose.launcher.events import NewPlan
from tfcompose.launcher.preflight import commands_of
from tfcompose.launcher.readiness import is_ready, unmet_in_words, waits_for
from tfcompose.launcher.stopping import refusal
from tfcompose.model.messages import (
    Done,
    DownRequest,
    PlanChange,
    ProcessRequest,
    ProcessStatus,
    Refusal,
    RobotStatus,
    UpdateRequest,
)
from tfcompose.model.plan.file import read_plan

if TYPE_CHECKING:
    from collections.abc import Mapping

    from tfcompose.launcher.child import ChildCommand
    from tfcompose.launcher.events import Event
    from tfcompose.launcher.preflight import Environment
    from tfcompose.launcher.state import State, Tracked
    from tfcompose.model.messages import Request
    from tfcompose.model.plan import Plan


#: Maximum size of a plan, in bytes.
MOST_PLAN_BYTES = 64_000_000

Answer = RobotStatus | Done | PlanChange | Refusal
#: The answer, the event for the machine, and a new plan's file and commands.
Outcome = tuple[Answer, "Event | None", "tuple[Path, dict[str, ChildCommand]] | None"]


def status(state: State, now: float) -> RobotStatus:
    """Return the status of a run and of all its processes."""
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
        silent=tuple(
            edge.name for edge in state.plan.edges if edge.child in state.silent & state.live
        ),
        processes=tuple(_process(state, tracked, now) for tracked in state.tracked.values()),
        findings=state.findings,
    )


def _process(state: State, tracked: Tracked, now: float) -> ProcessStatus:
    owned = [child for _, child in tracked.process.owns]
    return ProcessStatus(
        name=tracked.process.name,
        kind=tracked.process.kind,
        host=tracked.process.host,
        state=tracked.state,
        detail=tracked.detail,
        required=tracked.process.required,
        failed=bool(tracked.failed) or tracked.state == "fatal",
        ready=tracked.ready,
        waits=waits_for(state, tracked),
        seen=tracked.observed,
        pid=tracked.pid,
        uptime=round(now - tracked.began, 3) if tracked.state in ("running", "stopping") else None,
        restarts=tracked.restarts,
        edges=len(owned),
        live=sum(child in state.live and child not in state.silent for child in owned),
        nodes=tracked.process.nodes,
    )


def answer(
    request: Request,
    state: State,
    plan_file: Path,
    base: Mapping[str, str],
    environment: Environment,
) -> Outcome:
    """Return the answer, the event for the machine, and a new plan's file and commands."""
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
    request: UpdateRequest,
    state: State,
    plan_file: Path,
    base: Mapping[str, str],
    environment: Environment,
) -> Outcome:
    file = Path(request.plan)
    try:
        plan = read_plan(_plain_file(file).decode("utf-8"), str(file))
    except (OSError, ValueError, RejectedError) as error:
        return Refusal(f"{request.plan!r} cannot be used: {error}"), None, None
    if state.stop:
        return Refusal("the robot is stopping"), None, None
    try:
        commands, findings = commands_of(
            plan, plan.managed, file, base, environment, Path(request.base)
        )
    except ValueError as error:  # a NUL in the folder's name
        return Refusal(f"{request.base!r} cannot be used: {error}"), None, None
    if findings:
        return Refusal("; ".join(finding.message for finding in findings)), None, None
    different = change(state.plan, plan_file.parent, plan, file.parent)
    names, before = (
        [process.name for process in plan.processes],
        [process.name for process in state.plan.processes],
    )
    started = {process.name for process in (*state.plan.managed, *plan.managed)}
    answer = PlanChange(
        changed=tuple(name for name in names if name in different.changed & started),
        added=tuple(name for name in names if name not in before),
        removed=tuple(name for name in before if name not in names),
        held=different.held,
        described=tuple(name for name in names if name in different.described & started),
        differs=plan != state.plan,
    )
    if plan == state.plan and not (different.changed or different.described):
        return answer, None, None
    event = NewPlan(plan, different.changed, different.held, str(file), different.described)
    return answer, event, (file, commands)


def _plain_file(file: Path) -> bytes:
    """Return the content of a regular file, without waiting for a pipe or a device.

    Reads no more than the file's size. Kernel files such as ``/proc/kmsg``, on which a reader
    blocks, have size 0.

    Raises:
        OSError: if it is not a regular file, or is too large.
        ValueError: if its name contains NUL.
    """
    descriptor = os.open(file, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    with os.fdopen(descriptor, "rb") as stream:
        found = os.fstat(descriptor)
        if not stat.S_ISREG(found.st_mode):
            raise OSError("it is not a regular file")
        if found.st_size > MOST_PLAN_BYTES:
            raise OSError(f"it is larger than {MOST_PLAN_BYTES:,} bytes")
        data = stream.read(found.st_size)
    if data is None:
        raise BlockingIOError("reading it would block")
    return data


# Differences of another plan.


@dataclass(frozen=True, slots=True)
class PlanDifference:
    """The differences between two plans that affect a run."""

    #: Processes that must restart.
    changed: frozenset[str]
    #: Fixed edges that vanished. Listeners keep them until they restart.
    held: tuple[str, ...]
    #: Processes that differ only in the robot description, a parameter that they accept while they
    #: run.
    described: frozenset[str] = frozenset()


def change(old: Plan, old_folder: Path, new: Plan, new_folder: Path) -> PlanDifference:
    """Return the difference; each folder holds the files that belong to its plan."""
    described = _bytes(old_folder, old.description) != _bytes(new_folder, new.description)
    before = {process.name: process for process in old.processes}
    changed, redescribed = set(), set()
    for process in new.processes:
        other = before.get(process.name)
        if other is None:
            continue
        files = (_bytes(old_folder, other.params_file), _bytes(new_folder, process.params_file))
        same = old.start_settings(other) == new.start_settings(process)
        if same and _differ_only_in_description(*files):
            redescribed.add(process.name)
        elif not same or files[0] != files[1] or (described and new.describes(process)):
            changed.add(process.name)
    return PlanDifference(frozenset(changed), _vanished_edges(old, new), frozenset(redescribed))


#: The line with the description in a parameter file of the stock robot_state_publisher.
_DESCRIPTION = re.compile(rb'^ +"robot_description": "[^\n]*"$', re.MULTILINE)


def _differ_only_in_description(before: bytes | None, after: bytes | None) -> bool:
    """Return whether two parameter files differ only in the robot description.

    robot_state_publisher accepts a new description while it runs, but never forgets a fixed edge.
    If an edge vanishes or starts to move, the process's edges differ, and it restarts.
    """
    parts = [_DESCRIPTION.split(text or b"") for text in (before, after)]
    return before != after and len(parts[0]) > 1 and parts[0] == parts[1]


def _bytes(folder: Path, name: str | None) -> bytes | None:
    try:
        return None if name is None else _plain_file(folder / name)
    except OSError:
        return None


def _vanished_edges(old: Plan, new: Plan) -> tuple[str, ...]:
    """Return the fixed edges that vanish.

    tf2 never forgets a fixed edge, so listeners keep it until they restart.
    """
    children = {edge.child for edge in new.edges}
    return tuple(
        edge.name for edge in old.edges if edge.kind == "static" and edge.child not in children
    )
