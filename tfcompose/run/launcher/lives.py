"""What becomes of a process: it ends, is started again, is asked for by name, or leaves the plan."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from tfcompose.findings import did_you_mean
from tfcompose.ipc import Absent, Replanned
from tfcompose.run.launcher.action import Order
from tfcompose.run.launcher.failures import ended_by_itself, guard_lost, how_ended
from tfcompose.run.launcher.state import MAX_RESTARTS, Tracked
from tfcompose.run.launcher.timing import backoff_s

if TYPE_CHECKING:
    from tfcompose.ipc import ProcessRequest, Verb
    from tfcompose.run.launcher.happening import Exited, NewPlan
    from tfcompose.run.launcher.state import State
    from tfcompose.run.launcher.turn import Turn


def exited(turn: Turn, event: Exited) -> None:
    """Take the end of a process: meant, to be followed by a restart, or a failure."""
    name, how = event.name, how_ended(event.returncode)
    one = turn.state.tracked[name]
    if turn.state.stop:
        turn.enter(name, "STOPPED", how)
        return
    if name == turn.state.guard and turn.state.clear is not None and not one.leaving:
        _guard_ended(turn, one, event)
        return
    before = one
    lose(turn, one)
    one = turn.state.tracked[name]
    if one.leaving:
        _left(turn, one, how)
        return
    process, ready = one.process, one.process.ready
    meant = int(ready.number) if ready and ready.kind == "exit" else 0
    done = event.returncode == meant and process.kind == "run"
    if name != turn.state.guard and (process.restart == "always" or (process.restart == "on-failure" and not done)):
        _restart_later(turn, one, event)
        return
    turn.enter(name, "EXITED", how)
    # What others wait for has come, and does not go with the process.
    if done and ((before.ready and not process.owns) or (ready and ready.kind == "exit")):
        turn.track(name, replace(turn.state.tracked[name], ready=True, ready_since=before.ready_since or turn.now))
    early = name == turn.state.guard and turn.state.clear is None
    when = " before it said whether somebody publishes the plan's edges already" if early else ""
    if not done or process.required:
        when = ", and the plan requires it" if done else when
        turn.failed(name, ended_by_itself(name, event.returncode, when, event.last_lines))


def _guard_ended(turn: Turn, one: Tracked, event: Exited) -> None:
    """Have a guard that died follow itself: what it said holds, and the next one is given its memory."""
    if not turn.state.memory:
        lose(turn, one)
    unwatched = turn.now if turn.state.unwatched is None else turn.state.unwatched
    turn.know(unwatched=unwatched)
    _restart_later(turn, turn.state.tracked[event.name], event)
    if turn.state.stop is None:
        turn.show(guard_lost(event.name, event, strict=turn.state.plan.guard.mode == "strict"))


def lose(turn: Turn, one: Tracked) -> None:
    """Take the edges of a process as not live: it has ended, or is about to."""
    state, name = turn.state, one.process.name
    turn.track(name, replace(one, ready=False, ready_since=None, seen="", late=False))
    if name == state.guard:
        # A strict guard's memory holds what it latched, also for one that was asked for anew.
        memory = state.memory if state.plan.guard.mode == "strict" else {}
        turn.know(live=frozenset(), complete=not state.plan.edges, memory=memory)
    elif one.process.owns:
        live = state.live - {child for _, child in one.process.owns}
        turn.know(live=live, complete=False, waiting_said=None if state.waiting_said is None else turn.now)
        if state.guard is not None:
            turn.actions.append(Order(Absent(name)))


def _left(turn: Turn, one: Tracked, how: str) -> None:
    name = one.process.name
    turn.enter(name, "STOPPED", how, level=0, failures=0)
    if one.leaving == "drop":
        turn.know(tracked={other: each for other, each in turn.state.tracked.items() if other != name})
    else:
        turn.track(name, replace(turn.state.tracked[name], leaving="", wanted=one.leaving == "again"))


def _restart_later(turn: Turn, one: Tracked, event: Exited) -> None:
    name, times = event.name, turn.state.times
    most = MAX_RESTARTS if one.process.max_restarts is None else one.process.max_restarts
    failures = 1 if turn.now - one.since >= times.steady_s else one.failures + 1
    how = how_ended(event.returncode)
    if failures > most:
        turn.enter(name, "FATAL", how)
        when = f", after {most} restart{'' if most == 1 else 's'}"
        turn.failed(name, ended_by_itself(name, event.returncode, when, event.last_lines))
        return
    delay = backoff_s(times, failures)
    turn.enter(name, "BACKOFF", f"{how}; restart {failures} of {most} in {delay:g} s", failures=failures)


def refusal(state: State, name: str, verb: Verb) -> str | None:
    """Return why nobody can ask this of that process, in one sentence; None if it is done."""
    one = state.tracked.get(name)
    if one is None:
        advice = did_you_mean(name, state.tracked, f"it has {', '.join(state.tracked)}")
        return f"the plan has no process {name}; {advice}"
    if state.stop:
        return "everything is being stopped"
    if one.state == "EXPECTED":
        return f"somebody else starts and stops {name}"
    if name == state.guard and verb != "restart":
        return f"{name} watches the others and is not stopped alone; tfcompose up --guard off judges nobody"
    if verb == "start" and one.alive and one.leaving != "stop":
        return f"{name} runs already, with pid {one.pid}"
    if verb == "stop" and not one.alive and one.state != "BACKOFF" and not (one.state == "STOPPED" and one.wanted):
        return f"{name} does not run"
    return None


def asked(turn: Turn, event: ProcessRequest) -> None:
    """Stop, start or restart one process."""
    if refusal(turn.state, event.name, event.do):
        return
    one = turn.state.tracked[event.name]
    stays = event.do == "stop"
    if one.alive:
        turn.track(event.name, replace(one, leaving="stop" if stays else "again", wanted=not stays))
        return
    if one.state != "STOPPED":
        turn.enter(event.name, "STOPPED", failures=0)
    turn.track(event.name, replace(turn.state.tracked[event.name], wanted=not stays))


def follow(turn: Turn, event: NewPlan) -> None:
    """Follow another plan: stop what it has no more, start what is new, restart what is different."""
    state, plan = turn.state, event.plan
    before = state.tracked
    guards = [process.name for process in plan.processes if process.kind == "guard"]
    live = frozenset(edge.child for edge in plan.edges if edge.child in state.live)
    turn.know(
        plan=plan,
        guard=guards[0] if guards else None,
        tracked={process.name: _taken_over(before, process.name, event) for process in plan.processes},
        live=live,
        complete=len(live) == len(plan.edges),
        all_started=False,
        all_ready=False,
        waiting_said=turn.now,
        begun_anew=turn.now,
    )
    if state.guard is not None and not before[state.guard].alive:
        turn.know(memory={}, live=frozenset())  # the next one looks anew, at the new plan
    gone = {name: one for name, one in before.items() if name not in turn.state.tracked}
    for name, one in gone.items():
        if one.alive:
            turn.track(name, replace(one, leaving="drop", wanted=False))
    names = tuple(turn.state.tracked)
    changed = tuple(name for name in names if name in event.changed and name in before)
    added = tuple(name for name in names if name not in before)
    turn.tell(Replanned(changed, added, tuple(gone), event.held))


def _taken_over(before: dict[str, Tracked], name: str, event: NewPlan) -> Tracked:
    process = event.plan.process(name)
    one = before.get(name)
    rests = "EXPECTED" if process.kind == "external" else "STOPPED"
    if one is None:
        return Tracked(process, rests)  # type: ignore[arg-type]
    if name not in event.changed:
        return replace(one, process=process)
    if one.alive and rests == "STOPPED":
        return replace(one, process=process, leaving="again", wanted=True)
    return Tracked(process, rests, order=one.order)  # type: ignore[arg-type]
