"""When something is due: restarts, firmer signals, reminders. All times are seconds of the machine's clock."""

from __future__ import annotations

from signal import SIGKILL, SIGTERM, Signals
from typing import TYPE_CHECKING

from tfcompose.run.launcher.gates import late_at, opens_at
from tfcompose.run.launcher.vigil import due_at

if TYPE_CHECKING:
    from tfcompose.plan import PlanEdge, PlanProcess
    from tfcompose.run.launcher.state import State, Times, Tracked


def stop_signals(process: PlanProcess) -> tuple[Signals, ...]:
    """Return what the process is told, each when the one before did not help: its own signal, SIGTERM, SIGKILL."""
    return tuple(dict.fromkeys((Signals[process.stop.signal], SIGTERM, SIGKILL)))[
        : 1 + 2 * (process.stop.signal != "SIGKILL")
    ]


def backoff_s(times: Times, failures: int) -> float:
    """Return how long to wait before the restart after so many failures in a row."""
    return min(times.backoff_s * 2.0 ** (failures - 1), times.backoff_limit_s)


def by_owner(edges: tuple[PlanEdge, ...]) -> tuple[tuple[str, tuple[PlanEdge, ...]], ...]:
    """Return each owner with its edges, in the order of the edges."""
    owners = dict.fromkeys(edge.owner for edge in edges)
    return tuple((owner, tuple(edge for edge in edges if edge.owner == owner)) for owner in owners)


def waiting_due(state: State) -> float | None:
    """Return when missing edges are to be named; None if there is nothing new to name."""
    if state.clear is None or state.complete or not state.awaited:
        return None
    if state.waiting_said is None:
        return state.clear + state.times.waiting_s
    missing = {edge.child for edge in state.awaited}
    return None if missing == state.waiting else state.waiting_said + state.times.waiting_s


def stop_level(state: State, one: Tracked, now: float) -> int:
    """Return how many of its ``stop_signals`` the process should have been sent by now.

    The first is due when nothing runs that waits for the process, or when it alone is to end; each further one a while
    after the one before. A second signal to the launcher makes the second due at once, everywhere, and a third the
    third.
    """
    due = _firmer_at(state.times, one)
    level = one.level + 1 if due is not None and now >= due else one.level
    if level == 0 and (one.leaving or (state.stop and not _is_needed(state, one))):
        level = 1
    if state.stop and state.stop.signals > 1:
        level = max(level, state.stop.signals)
    return min(level, len(stop_signals(one.process)))


def _firmer_at(times: Times, one: Tracked) -> float | None:
    """Return when the next signal is due: the plan's time counts for each, or else the launcher's."""
    if one.state != "STOPPING" or not 0 < one.level < len(stop_signals(one.process)):
        return None
    own = one.process.stop.timeout_s
    default = times.interrupt_s if one.level == 1 else times.terminate_s
    return one.since + (default if own is None else own)


def _is_needed(state: State, one: Tracked) -> bool:
    others = [other for other in state.tracked.values() if other.alive and other is not one]
    if one.process.name == state.guard:
        return bool(others)
    return any(one.process.name in other.process.after and other.process.name != state.guard for other in others)


def wake_time(state: State) -> float | None:
    """Return when the machine next has something to do by itself: then it wants a ``Tick``."""
    times, due = state.times, []
    for one in state.tracked.values():
        if one.state == "BACKOFF":
            due.append(one.since + backoff_s(times, one.failures))
        firmer = _firmer_at(times, one)
        gate = [at for at in (firmer, opens_at(one), late_at(state, one)) if at is not None]
        due += gate if state.stop is None else gate[: firmer is not None]
    if state.stop is None and state.begun is not None:
        if state.clear is None:
            due.append(state.begun + times.clear_s)
        if (hangs := due_at(state)) is not None:
            due.append(hangs)
        reminder = waiting_due(state)
        if reminder is not None:
            due.append(reminder)
    return min(due, default=None)
