"""How everything ends: what asks for it, and who is told when, and how firmly."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from tfcompose.ipc import DownRequest
from tfcompose.run.launcher.action import Kill
from tfcompose.run.launcher.failures import in_short, never_seen, signal_name
from tfcompose.run.launcher.happening import OutputLost, Signalled, TimeUp
from tfcompose.run.launcher.lives import lose
from tfcompose.run.launcher.state import UNREAD, Stop
from tfcompose.run.launcher.timing import by_owner, stop_level, stop_signals

if TYPE_CHECKING:
    from tfcompose.findings import Finding
    from tfcompose.run.launcher.happening import Event
    from tfcompose.run.launcher.turn import Turn


def asked_to_end(turn: Turn, event: Event) -> None:
    """Begin to stop everything if that is what the event asks for."""
    match event:
        case DownRequest():
            turn.stop(Stop("signal", 0, 1, turn.now), "tfcompose down")
        case Signalled(number):
            _signalled(turn, signal_name(number))
        case OutputLost():
            turn.stop(Stop("failure", UNREAD), "nobody reads the output any more")
        case TimeUp():
            _time_up(turn)
        case _:
            pass


def _signalled(turn: Turn, name: str) -> None:
    stop = turn.state.stop
    if stop is None:
        turn.stop(Stop("signal", 0, 1, turn.now), name)
    elif stop.signals == 0 or turn.now - stop.signalled >= turn.state.times.same_signal_s:
        turn.know(stop=replace(stop, signals=stop.signals + 1, signalled=turn.now))


def _time_up(turn: Turn) -> None:
    state = turn.state
    if state.stop:
        return
    complete = state.complete or state.guard is None
    if not complete and "TF811" not in state.shown:
        for owner, edges in by_owner(state.awaited):
            turn.show(never_seen(state.tracked[owner], edges))
    failed = not complete or bool(turn.state.shown or state.given_up)
    turn.stop(Stop("time", 1 if failed else 0), "the time is up")


def taken(turn: Turn, found: Finding) -> None:
    """Stop everything, because somebody publishes an edge of the plan already; each such edge is told."""
    stop = turn.state.stop
    if stop is None or stop.cause == "taken":
        turn.show(found)
        turn.stop(Stop("taken", 1), in_short(found))


def stop_on(turn: Turn) -> None:
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
