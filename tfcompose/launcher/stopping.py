"""How everything, or one process, is stopped: what requests it, and which signal a process is sent when.

A process is first sent its own signal, then SIGTERM, then SIGKILL, each when the one before did not help.
"""

from __future__ import annotations

from dataclasses import replace
from signal import SIGKILL, SIGTERM, Signals
from typing import TYPE_CHECKING

from tfcompose.ipc import DownRequest
from tfcompose.launcher.events import Kill, OutputLost, Signalled, TimeUp
from tfcompose.launcher.failures import in_short, never_published, signal_name
from tfcompose.launcher.restarts import lose_edges
from tfcompose.launcher.state import UNREAD, Stop, by_owner

if TYPE_CHECKING:
    from tfcompose.findings import Finding
    from tfcompose.launcher.events import Event
    from tfcompose.launcher.state import State, Times, Tracked, Transition
    from tfcompose.plan import PlanProcess


# What requests that everything stops.


def stop_if_requested(step: Transition, event: Event) -> None:
    """Begin to stop everything if that is what the event requests."""
    match event:
        case DownRequest():
            step.stop(Stop("signal", 0, 1, step.now), "tfcompose down")
        case Signalled(number):
            _signalled(step, signal_name(number))
        case OutputLost():
            step.stop(Stop("failure", UNREAD), "nobody reads the output any more")
        case TimeUp():
            _time_up(step)
        case _:
            pass


def _signalled(step: Transition, name: str) -> None:
    stop = step.state.stop
    if stop is None:
        step.stop(Stop("signal", 0, 1, step.now), name)
    elif stop.signals == 0 or step.now - stop.signalled >= step.state.times.same_signal_s:
        step.update(stop=replace(stop, signals=stop.signals + 1, signalled=step.now))


def _time_up(step: Transition) -> None:
    state = step.state
    if state.stop:
        return
    complete = state.complete or state.guard is None
    if not complete and "TF811" not in state.reported:
        for owner, edges in by_owner(state.awaited):
            step.report(never_published(state.tracked[owner], edges))
    failed = not complete or bool(step.state.reported or state.given_up)
    step.stop(Stop("time", 1 if failed else 0), "the time is up")


def edge_taken(step: Transition, found: Finding) -> None:
    """Stop everything, because somebody publishes an edge of the plan already; each such edge is reported."""
    stop = step.state.stop
    if stop is None or stop.cause == "taken":
        step.report(found)
        step.stop(Stop("taken", 1), in_short(found))


# Which signal is due.


def stop_signals(process: PlanProcess) -> tuple[Signals, ...]:
    """Return what the process is sent, each when the one before did not help: its own signal, SIGTERM, SIGKILL."""
    return tuple(dict.fromkeys((Signals[process.stop.signal], SIGTERM, SIGKILL)))[
        : 1 + 2 * (process.stop.signal != "SIGKILL")
    ]


def send_due_signals(step: Transition) -> None:
    """Signal processes that are to end, in reverse order of their start, and more firmly where that did not help."""
    alive = [one for one in step.state.tracked.values() if one.alive]
    for one in sorted(alive, key=lambda one: -one.order):
        level = _due_level(step.state, one, step.now)
        if one.state == "STARTING" or level <= one.level:
            continue
        name, signals = one.process.name, stop_signals(one.process)
        if one.level == 0 and one.leaving:
            lose_edges(step, one)
        step.actions.append(Kill(name, signals[level - 1]))
        before = f"still there after {signals[one.level - 1].name}: " if one.level else ""
        step.enter(name, "STOPPING", before + signals[level - 1].name, pid=one.pid, level=level)


def firmer_at(times: Times, one: Tracked) -> float | None:
    """Return when the next signal is due: the plan's time counts for each, or else the launcher's."""
    if one.state != "STOPPING" or not 0 < one.level < len(stop_signals(one.process)):
        return None
    own = one.process.stop.timeout_s
    default = times.interrupt_s if one.level == 1 else times.terminate_s
    return one.since + (default if own is None else own)


def _due_level(state: State, one: Tracked, now: float) -> int:
    """Return how many of its ``stop_signals`` the process should have been sent by now.

    The first is due when nothing runs that waits for the process, or when it alone is to end; each further one a while
    after the one before. A second signal to the launcher makes the second due at once, everywhere, and a third the
    third.
    """
    due = firmer_at(state.times, one)
    level = one.level + 1 if due is not None and now >= due else one.level
    if level == 0 and (one.leaving or (state.stop and not _is_needed(state, one))):
        level = 1
    if state.stop and state.stop.signals > 1:
        level = max(level, state.stop.signals)
    return min(level, len(stop_signals(one.process)))


def _is_needed(state: State, one: Tracked) -> bool:
    others = [other for other in state.tracked.values() if other.alive and other is not one]
    if one.process.name == state.guard:
        return bool(others)
    return any(one.process.name in other.process.after and other.process.name != state.guard for other in others)
