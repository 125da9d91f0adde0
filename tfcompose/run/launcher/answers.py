"""What the launcher answers to other commands."""

from __future__ import annotations

import os
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tfcompose.findings import RejectedError
from tfcompose.plan.file import read_plan
from tfcompose.run.launcher.gates import is_ready, waits_for
from tfcompose.run.launcher.happening import Asked, Down, NewPlan
from tfcompose.run.launcher.lives import refusal
from tfcompose.run.launcher.preflight import commands_of, started_by_us
from tfcompose.run.launcher.prerequisites import unmet_in_words
from tfcompose.run.launcher.replan import change

if TYPE_CHECKING:
    from collections.abc import Mapping

    from tfcompose.run.launcher.command import Command
    from tfcompose.run.launcher.happening import Event
    from tfcompose.run.launcher.preflight import Environment
    from tfcompose.run.launcher.state import State, Tracked


def status(state: State, now: float) -> dict[str, Any]:
    """Return all that is known of a run, as plain data; times are seconds until now."""
    return {
        "robot": state.plan.robot,
        "host": state.plan.host,
        "launcher": os.getpid(),
        "plan": state.plan.spec_digest,
        "uptime": round(now - (state.begun or now), 3),
        "complete": state.complete and not state.silent,
        "ready": is_ready(state),
        "stopping": state.stop is not None,
        "missing": [edge.name for edge in state.missing],
        "silent": [edge.name for edge in state.plan.edges if edge.child in state.silent & state.live],
        "processes": [_process(state, one, now) for one in state.tracked.values()],
    }


def _process(state: State, one: Tracked, now: float) -> dict[str, Any]:
    owned = [child for _, child in one.process.owns]
    return {
        "name": one.process.name,
        "kind": one.process.kind,
        "host": one.process.host,
        "state": one.state,
        "detail": one.detail,
        "required": one.process.required,
        "failed": bool(one.failed) or one.state == "FATAL",
        "ready": one.ready,
        "waits": waits_for(state, one),
        "seen": one.seen,
        "pid": one.pid,
        "uptime": round(now - one.began, 3) if one.state in ("RUNNING", "STOPPING") else None,
        "restarts": one.restarts,
        "edges": len(owned),
        "live": sum(child in state.live and child not in state.silent for child in owned),
        "nodes": list(one.process.nodes),
    }


def answer(
    request: dict[str, Any], state: State, plan_file: Path, base: Mapping[str, str], environment: Environment
) -> tuple[dict[str, Any], Event | None, tuple[Path, dict[str, Command]] | None]:
    """Return the answer, what it means for the machine, and, for another plan, its file and commands."""
    do, name = request.get("do"), str(request.get("name", ""))
    if do == "ps":
        return status(state, time.monotonic()), None, None
    if do == "down":
        return {"ok": True}, Down(), None
    if do in ("restart", "start", "stop"):
        if why := refusal(state, name, do):
            return {"error": why}, None, None
        waits = "" if do == "stop" else unmet_in_words(state, state.tracked[name])
        return {"ok": True, "waits": waits}, Asked(name, do), None
    if do == "update":
        return _update(request, state, plan_file, base, environment)
    return {"error": f"there is nothing like {do!r} to do"}, None, None


def _update(
    request: dict[str, Any], state: State, plan_file: Path, base: Mapping[str, str], environment: Environment
) -> tuple[dict[str, Any], Event | None, tuple[Path, dict[str, Command]] | None]:
    file, built_in = Path(str(request.get("plan", ""))), Path(str(request.get("base", "")))
    try:
        plan = read_plan(file.read_text("utf-8"), str(file))
    except (OSError, RejectedError) as error:
        return {"error": f"{file} cannot be used: {error}"}, None, None
    if state.stop:
        return {"error": "everything is being stopped"}, None, None
    commands, found = commands_of(plan, started_by_us(plan), file, base, environment, built_in)
    if found:
        return {"error": "; ".join(one.message for one in found)}, None, None
    different = change(state.plan, plan_file.parent, plan, file.parent)
    names, before = [process.name for process in plan.processes], [process.name for process in state.plan.processes]
    said = {
        "changed": [name for name in names if name in different.changed],
        "added": [name for name in names if name not in before],
        "removed": [name for name in before if name not in names],
        "held": list(different.held),
    }
    if not any(said.values()):
        return {"ok": True, **said}, None, None
    return {"ok": True, **said}, NewPlan(plan, different.changed, different.held), (file, commands)
