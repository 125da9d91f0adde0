"""What the launcher does next: a pure function of what is known, what happened, and the time.

The guard is started first and listens; once it says that nobody publishes a planned edge, the others follow in the
plan's order, each when what it waits for is there. A guard that is switched off only says which edges are live, and
nothing waits for its word. Whatever goes wrong, or is asked for, everything is stopped: a process when all that wait
for it are gone, the guard last of all. What the guard says while everything stops is not heeded, because an owner that
is stopped falls silent.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from tfcompose.ipc import GateOpen, GateShut, Missing, OwnerReady, ProcessRequest, Taken, Waiting
from tfcompose.run.launcher.ending import asked_to_end, stop_on, taken
from tfcompose.run.launcher.failures import never_clear, not_started
from tfcompose.run.launcher.gates import kind_of, look, opened, order_gate, say_progress
from tfcompose.run.launcher.guard_said import guard_said, owner_ready, say_of
from tfcompose.run.launcher.happening import (
    Begin,
    Event,
    Exited,
    LogSeen,
    NewPlan,
    Started,
    StartFailed,
)
from tfcompose.run.launcher.lives import asked, exited, follow
from tfcompose.run.launcher.prerequisites import give_up_waiting, unmet
from tfcompose.run.launcher.timing import backoff_s, by_owner, waiting_due
from tfcompose.run.launcher.turn import Turn
from tfcompose.run.launcher.vigil import forget, keep

if TYPE_CHECKING:
    from tfcompose.plan import Plan, PlanEdge
    from tfcompose.run.launcher.action import Action
    from tfcompose.run.launcher.state import State


def step(state: State, event: Event, now: float) -> tuple[State, tuple[Action, ...]]:
    """Return what is known after the event, and what is to be done, in that order. ``now`` is in seconds."""
    if state.finished:
        return state, ()
    turn = Turn(state, now)
    _react(turn, event)
    _settle(turn)
    return turn.state, tuple(turn.actions)


# What happened.


def _react(turn: Turn, event: Event) -> None:
    match event:
        case Begin():
            _begin(turn)
        case Started(name, pid):
            _started(turn, name, pid)
        case StartFailed(name, why):
            _not_started(turn, name, why)
        case Exited():
            exited(turn, event)
        case Taken(found):
            taken(turn, found)
        case _:
            asked_to_end(turn, event)
            if turn.state.stop is None:
                _asked_or_seen(turn, event)


def _asked_or_seen(turn: Turn, event: Event) -> None:
    match event:
        case ProcessRequest():
            asked(turn, event)
        case NewPlan():
            follow(turn, event)
        case GateOpen(process, seen) | LogSeen(process, seen) if process in turn.state.tracked:
            if kind_of(turn.state.tracked[process].process) not in ("edges", "exit", "time"):
                opened(turn, process, seen)
        case GateShut(process, seen) if process in turn.state.tracked:
            turn.track(process, replace(turn.state.tracked[process], seen=seen))
        case OwnerReady(process) if process in turn.state.tracked:
            owner_ready(turn, process)
        case _:  # the guard's other events, and Tick
            guard_said(turn, event)


def _not_started(turn: Turn, name: str, why: str) -> None:
    one = turn.state.tracked[name]
    turn.enter(name, "FATAL", why, order=one.order if one.began else 0)
    turn.failed(name, not_started(name, why))


def _begin(turn: Turn) -> None:
    guard = turn.state.guard
    judges = guard is not None and turn.state.plan.guard.mode != "off"
    turn.know(begun=turn.now, clear=None if judges else turn.now)
    if guard:
        turn.start(guard)
    for name, tracked in turn.state.tracked.items():
        if tracked.state == "EXPECTED":
            turn.enter(name, "EXPECTED", began=turn.now)
            order_gate(turn, turn.state.tracked[name])


def _started(turn: Turn, name: str, pid: int) -> None:
    turn.enter(name, "RUNNING", pid=pid, began=turn.now)
    if name != turn.state.guard:
        order_gate(turn, turn.state.tracked[name])
        return
    forget(turn)
    turn.know(silent=frozenset())  # it says itself what is
    if turn.state.clear is not None:  # it joins the others
        for other in turn.state.tracked.values():
            say_of(turn, other)
            if not other.ready and other.state in ("RUNNING", "EXPECTED"):
                order_gate(turn, other)


# What follows.


def _settle(turn: Turn) -> None:
    """Do what is due, now that the event has been taken in."""
    state = turn.state
    if state.begun is None:
        return
    if state.stop is None and state.clear is None and turn.now >= state.begun + state.times.clear_s:
        turn.fail(never_clear(state.guard or "guard", state.times.clear_s))
    if turn.state.stop is None:
        _go_on(turn)
    stop_on(turn)
    if turn.state.stop and not any(one.alive for one in turn.state.tracked.values()):
        turn.finish(turn.state.stop.exit_code)


def _go_on(turn: Turn) -> None:
    look(turn)
    keep(turn)
    give_up_waiting(turn)
    for name, one in turn.state.tracked.items():
        if one.state not in ("STOPPED", "BACKOFF"):
            continue
        fresh = one.state == "STOPPED" and one.wanted and turn.state.clear is not None and not unmet(turn.state, one)
        again = one.state == "BACKOFF" and turn.now >= one.since + backoff_s(turn.state.times, one.failures)
        if fresh or again:
            turn.start(name)
    say_progress(turn)
    due = waiting_due(turn.state)
    if due is not None and turn.now >= due:
        missing = turn.state.awaited
        turn.know(waiting=frozenset(edge.child for edge in missing), waiting_said=turn.now)
        turn.tell(Waiting(tuple(_missing(turn.state.plan, owner, edges) for owner, edges in by_owner(missing))))
    tracked = turn.state.tracked.values()
    if turn.state.stop is None and all(one.failed or one.state in ("EXITED", "EXPECTED") for one in tracked):
        turn.finish(1 if turn.state.given_up else 0)


def _missing(plan: Plan, owner: str, edges: tuple[PlanEdge, ...]) -> Missing:
    return Missing(owner, edges[0].node, tuple(edge.name for edge in edges), len(plan.edges_of(owner)))
