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

from tfcompose.run.events import (
    Clear,
    Complete,
    Found,
    GateOpen,
    GateShut,
    Live,
    OwnerReady,
    Recovered,
    Remember,
    Taken,
)
from tfcompose.run.launcher.failures import in_short, never_clear, never_seen, not_started, signal_name
from tfcompose.run.launcher.gates import kind_of, look, opened, order_gate, say_progress
from tfcompose.run.launcher.lives import asked, exited, follow, lose
from tfcompose.run.launcher.notice import Missing, OwnerLive, RecoveredShown, TreeComplete, Waiting
from tfcompose.run.launcher.offender import judged
from tfcompose.run.launcher.state import (
    UNREAD,
    Action,
    Asked,
    Begin,
    Down,
    Event,
    Exited,
    Kill,
    LogSeen,
    NewPlan,
    Order,
    OutputLost,
    Signalled,
    Started,
    StartFailed,
    State,
    Stop,
    TimeUp,
    Tracked,
)
from tfcompose.run.launcher.timing import backoff_s, by_owner, stop_level, stop_signals, waiting_due
from tfcompose.run.launcher.turn import Turn
from tfcompose.run.orders import Absent, Present

if TYPE_CHECKING:
    from tfcompose.diagnostic import Diagnostic
    from tfcompose.plan import Plan, PlanEdge


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
            turn.enter(name, "FATAL", why)
            turn.fail(not_started(name, why))
        case Exited():
            exited(turn, event)
        case Taken(found):
            _taken(turn, found)
        case _:
            _asked_to_end(turn, event)
            if turn.state.stop is None:
                _asked_or_seen(turn, event)


def _asked_to_end(turn: Turn, event: Event) -> None:
    match event:
        case Down():
            turn.stop(Stop("signal", 0, 1, turn.now), "tfcompose down")
        case Signalled(number):
            _signalled(turn, signal_name(number))
        case OutputLost():
            turn.stop(Stop("failure", UNREAD), "nobody reads the output any more")
        case TimeUp():
            _time_up(turn)
        case _:
            pass


def _asked_or_seen(turn: Turn, event: Event) -> None:
    match event:
        case Asked():
            asked(turn, event)
        case NewPlan():
            follow(turn, event)
        case GateOpen(process, seen) | LogSeen(process, seen) if process in turn.state.tracked:
            if kind_of(turn.state.tracked[process].process) not in ("edges", "exit", "time"):
                opened(turn, process, seen)
        case GateShut(process, seen) if process in turn.state.tracked:
            turn.track(process, replace(turn.state.tracked[process], seen=seen))
        case OwnerReady(process) if process in turn.state.tracked:
            _owner_ready(turn, process)
        case _:  # the guard's other events, and Tick
            _guard_said(turn, event)


def _owner_ready(turn: Turn, process: str) -> None:
    if kind_of(turn.state.tracked[process].process) == "edges":
        opened(turn, process, "its edges are live")
    edges = turn.state.plan.edges_of(process)
    if edges:
        names = tuple(edge.name for edge in edges)
        turn.tell(OwnerLive(process, edges[0].node, names, turn.now - (turn.state.begun or 0.0)))
        if not turn.state.missing:
            _complete(turn, len(turn.state.plan.edges))


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
    elif turn.state.clear is not None:  # it joins the others
        for other in turn.state.tracked.values():
            _say_of(turn, other)
            if not other.ready and other.state in ("RUNNING", "EXPECTED"):
                order_gate(turn, other)


def _say_of(turn: Turn, owner: Tracked) -> None:
    """Tell a guard that joins what became of an owner meanwhile, whatever the one before it knew."""
    name = owner.process.name
    runs = owner.state in ("STARTING", "RUNNING", "EXPECTED")
    missing = any(child not in turn.state.live for _, child in owner.process.owns)
    if owner.process.owns and not runs:
        turn.actions.append(Order(Absent(name)))
    elif missing and turn.state.memory:
        turn.actions += [Order(Absent(name)), Order(Present(name))]


def _signalled(turn: Turn, name: str) -> None:
    stop = turn.state.stop
    if stop is None:
        turn.stop(Stop("signal", 0, 1, turn.now), name)
    elif stop.signals == 0 or turn.now - stop.signalled >= turn.state.times.same_signal_s:
        turn.know(stop=replace(stop, signals=stop.signals + 1, signalled=turn.now))


def _time_up(turn: Turn) -> None:
    if turn.state.stop:
        return
    complete = turn.state.complete or turn.state.guard is None
    if not complete and "TF811" not in turn.state.shown:
        for owner, edges in by_owner(turn.state.missing):
            turn.show(never_seen(turn.state.tracked[owner], edges))
    failed = not complete or bool(turn.state.shown)
    turn.stop(Stop("time", 1 if failed else 0), "the time is up")


def _taken(turn: Turn, found: Diagnostic) -> None:
    stop = turn.state.stop
    if stop is None or stop.cause == "taken":
        turn.show(found)
        turn.stop(Stop("taken", 1), in_short(found))


def _guard_said(turn: Turn, event: Event) -> None:
    seconds = turn.now - (turn.state.begun or 0.0)
    match event:
        case Clear():
            _cleared(turn, seconds)
        case Live(child=child):
            turn.know(live=turn.state.live | {child})
        case Complete(edges):
            _complete(turn, edges)
        case Found(found, process):
            judged(turn, found, process)
        case Recovered(message):
            turn.tell(RecoveredShown(message, seconds))
        case Remember(changed):
            turn.know(memory=turn.state.memory | changed)
        case _:
            pass


def _cleared(turn: Turn, seconds: float) -> None:
    state = turn.state
    if state.clear is None:
        turn.know(clear=turn.now)
    if state.unwatched is not None:
        turn.know(unwatched=None)
        turn.tell(RecoveredShown(f"{state.guard} watches again after {turn.now - state.unwatched:.1f} s", seconds))


def _complete(turn: Turn, edges: int) -> None:
    if not turn.state.complete:
        turn.know(complete=True)
        turn.tell(TreeComplete(edges, turn.now - (turn.state.begun or 0.0)))


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
    _stop_on(turn)
    if turn.state.stop and not any(one.alive for one in turn.state.tracked.values()):
        turn.finish(turn.state.stop.exit_code)


def _go_on(turn: Turn) -> None:
    look(turn)
    tracked = turn.state.tracked
    for name, one in tracked.items():
        if one.state not in ("STOPPED", "BACKOFF"):
            continue
        fresh = one.state == "STOPPED" and one.wanted and turn.state.clear is not None and _may_start(turn, one)
        again = one.state == "BACKOFF" and turn.now >= one.since + backoff_s(turn.state.times, one.failures)
        if fresh or again:
            turn.start(name)
    say_progress(turn)
    due = waiting_due(turn.state)
    if due is not None and turn.now >= due:
        missing = turn.state.missing
        turn.know(waiting=frozenset(edge.child for edge in missing), waiting_said=turn.now)
        turn.tell(Waiting(tuple(_missing(turn.state.plan, owner, edges) for owner, edges in by_owner(missing))))
    if all(one.state in ("EXITED", "EXPECTED") for one in turn.state.tracked.values()):
        turn.finish(0)


def _missing(plan: Plan, owner: str, edges: tuple[PlanEdge, ...]) -> Missing:
    return Missing(owner, edges[0].node, tuple(edge.name for edge in edges), len(plan.edges_of(owner)))


def _may_start(turn: Turn, one: Tracked) -> bool:
    return all(_is_there(turn, name, what) for name, what in one.process.after.items())


def _is_there(turn: Turn, name: str, what: str) -> bool:
    other = turn.state.tracked[name]
    if what == "ready":
        return other.ready
    return other.state == "EXITED" if what == "done" else other.was_started or other.state == "EXPECTED"


def _stop_on(turn: Turn) -> None:
    """Tell processes that are to end, in reverse order of their start, and more firmly where that did not help."""
    alive = [one for one in turn.state.tracked.values() if one.alive]
    for one in sorted(alive, key=lambda one: -one.order):
        level = stop_level(turn.state, one, turn.now)
        if one.state == "STARTING" or level <= one.level:
            continue
        name, signals = one.process.name, stop_signals(one.process)
        if one.level == 0 and one.leaving:
            lose(turn, one)
        turn.actions.append(Kill(name, signals[level - 1]))
        before = f"still there after {signals[one.level - 1].name}: " if one.level else ""
        turn.enter(name, "STOPPING", before + signals[level - 1].name, pid=one.pid, level=level)
