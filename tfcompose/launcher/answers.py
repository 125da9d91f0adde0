"""The launcher's answers to other commands, and the effects of a changed plan on a run."""

from __future__ import annotations

import os
import re
import stat
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.foundation.findings import RejectedError
from tfcompose.launcher.events import NewPlan
from tfcompose.launcher.preflight import commands_of
from tfcompose.launcher.readiness import is_ready, unmet_in_words, waits_for
from tfcompose.launcher.stopping import refusal
from tfcompose.model.messages import (
    Adjustment,
    AdjustRequest,
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
    from tfcompose.model.plan import Plan, PlanEdge


#: Maximum size of a plan, in bytes.
MOST_PLAN_BYTES = 64_000_000

Answer = RobotStatus | Done | PlanChange | Refusal
#: The answer, an event for the process machine, and the file and commands of a new plan.
Outcome = tuple[Answer, "Event | None", "tuple[Path, dict[str, ChildCommand]] | None"]


def status(state: State, now: float) -> RobotStatus:
    """Return the status of a run and of all its processes."""
    return RobotStatus(
        robot=state.plan.robot,
        host=state.plan.host,
        launcher=os.getpid(),
        plan=state.plan.spec_digest,
        overlays=state.plan.overlays,
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
        adjusted=tuple(
            Adjustment(edge.name, *edge.adjustment)
            for edge in state.plan.adjusted
            if edge.adjustment
        ),
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


@dataclass(frozen=True, slots=True)
class CommandInputs:
    """Inputs of a run's commands besides its plan."""

    plan_file: Path
    #: The folder that the plan was built in; None: that of ``plan_file``.
    build_folder: Path | None
    #: The launcher's environment.
    base: Mapping[str, str]
    environment: Environment


def answer(request: Request, state: State, inputs: CommandInputs) -> Outcome:
    """Return the answer, an event for the process machine, and a new plan's file and commands."""
    match request:
        case DownRequest():
            return Done(), request, None
        case ProcessRequest(verb, name):
            if why := refusal(state, name, verb):
                return Refusal(why), None, None
            waits = "" if verb == "stop" else unmet_in_words(state, state.tracked[name])
            return Done(waits=waits), request, None
        case UpdateRequest(plan, base):
            return _update(Path(plan), state, replace(inputs, build_folder=Path(base)))
        case AdjustRequest():
            return _adjust(request, state, inputs)
        case _:
            return status(state, time.monotonic()), None, None


def _adjust(request: AdjustRequest, state: State, inputs: CommandInputs) -> Outcome:
    # The folder may have moved since, see RunFiles; its last part is the plan's digest.
    if Path(request.replaces).parent.name != inputs.plan_file.parent.name:
        return Refusal("the robot runs another plan by now"), None, None
    outcome = _update(Path(request.plan), state, inputs)
    match outcome[0]:
        case PlanChange(changed, added, removed) if changed or added or removed:
            names = ", ".join((*changed, *added, *removed))
            return Refusal(f"the plan differs in more than poses: {names}"), None, None
        case _:
            return outcome


def _update(file: Path, state: State, inputs: CommandInputs) -> Outcome:
    try:
        plan = read_plan(_plain_file(file).decode("utf-8"), str(file))
    except (OSError, ValueError, RejectedError) as error:
        return Refusal(f"{str(file)!r} cannot be used: {error}"), None, None
    if state.stop:
        return Refusal("the robot is stopping"), None, None
    try:
        commands, findings = commands_of(
            plan, plan.managed, file, inputs.base, inputs.environment, inputs.build_folder
        )
    except ValueError as error:  # a NUL in the folder's name
        return Refusal(f"{str(inputs.build_folder)!r} cannot be used: {error}"), None, None
    if findings:
        return Refusal("; ".join(finding.message for finding in findings)), None, None
    different = change(state.plan, inputs.plan_file.parent, plan, file.parent)
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
        moved=different.moved,
    )
    if plan == state.plan and not different.names:
        return answer, None, None
    event = NewPlan(
        plan,
        different.changed,
        different.held,
        file=str(file),
        described=different.described,
        followers=different.followers,
        moved=different.moved,
    )
    return answer, event, (file, commands)


def _plain_file(file: Path) -> bytes:
    """Return the content of a regular file; never wait for a pipe or a device.

    The function reads no more bytes than the file's size. Kernel files that block a reader, such
    as ``/proc/kmsg``, have size 0.

    Raises:
        OSError: if the file is not a regular file, or is too large.
        ValueError: if its name contains NUL.
    """
    descriptor = os.open(file, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    with os.fdopen(descriptor, "rb") as stream:
        status = os.fstat(descriptor)
        if not stat.S_ISREG(status.st_mode):
            raise OSError("it is not a regular file")
        if status.st_size > MOST_PLAN_BYTES:
            raise OSError(f"it is larger than {MOST_PLAN_BYTES:,} bytes")
        data = stream.read(status.st_size)
    if data is None:
        raise BlockingIOError("reading it would block")
    return data


# Differences between plans.


@dataclass(frozen=True, slots=True)
class PlanDifference:
    """The differences between two plans that affect a run."""

    #: Processes that must restart.
    changed: frozenset[str]
    #: Fixed edges that the new plan lacks. Listeners keep them until they restart.
    held: tuple[str, ...]
    #: Processes that differ only in the robot description. They accept this parameter while they
    #: run.
    described: frozenset[str] = frozenset()
    #: Processes that read the plan again while they run: poses or the description differ.
    followers: frozenset[str] = frozenset()
    #: Fixed edges whose poses differ, of processes that need no restart.
    moved: tuple[str, ...] = ()

    @property
    def names(self) -> frozenset[str]:
        """The processes that differ in anything."""
        return self.changed | self.described | self.followers


def change(old: Plan, old_folder: Path, new: Plan, new_folder: Path) -> PlanDifference:
    """Return the differences; each folder contains the files of its plan."""
    before = {process.name: process for process in old.processes}
    changed, redescribed, followers = set(), set(), set()
    for process in new.processes:
        previous = before.get(process.name)
        if previous is None:
            continue
        files = (_bytes(old_folder, previous.params_file), _bytes(new_folder, process.params_file))
        same = old.start_settings(previous) == new.start_settings(process)
        described = new.describes(process) and (
            _bytes(old_folder, previous.description or old.description)
            != _bytes(new_folder, process.description or new.description)
        )
        if same and _differ_only_in_description(*files):
            redescribed.add(process.name)
        elif not same or files[0] != files[1] or (described and process.kind != "static"):
            changed.add(process.name)
        elif described or _moved_edges(old, new, process.name):
            followers.add(process.name)
    moved = [
        edge.name
        for process in new.processes
        if process.name not in changed
        for edge in _moved_edges(old, new, process.name)
    ]
    return PlanDifference(
        frozenset(changed),
        _vanished_edges(old, new),
        frozenset(redescribed),
        frozenset(followers),
        tuple(moved),
    )


def _moved_edges(old: Plan, new: Plan, owner: str) -> list[PlanEdge]:
    """Return the fixed edges of a process whose poses differ."""
    before = {edge.name: edge.pose for edge in old.edges_of(owner)}
    return [
        edge
        for edge in new.edges_of(owner)
        if edge.kind == "static" and edge.pose != before.get(edge.name, edge.pose)
    ]


#: The line with the robot description in a parameter file of robot_state_publisher.
_DESCRIPTION = re.compile(rb'^ +"robot_description": "[^\n]*"$', re.MULTILINE)


def _differ_only_in_description(before: bytes | None, after: bytes | None) -> bool:
    """Return whether two parameter files differ only in the robot description.

    robot_state_publisher accepts a new description while it runs, but keeps every fixed edge. If a
    fixed edge vanishes or becomes a moving edge, the process owns different edges and restarts
    anyway.
    """
    parts = [_DESCRIPTION.split(text or b"") for text in (before, after)]
    return before != after and len(parts[0]) > 1 and parts[0] == parts[1]


def _bytes(folder: Path, name: str | None) -> bytes | None:
    try:
        return None if name is None else _plain_file(folder / name)
    except OSError:
        return None


def _vanished_edges(old: Plan, new: Plan) -> tuple[str, ...]:
    """Return the fixed edges that the new plan lacks.

    tf2 never forgets a fixed edge, so listeners keep these edges until they restart.
    """
    children = {edge.child for edge in new.edges}
    return tuple(
        edge.name for edge in old.edges if edge.kind == "static" and edge.child not in children
    )
