"""When something is due: restarts, firmer signals, reminders. All times are seconds of the machine's clock."""

from __future__ import annotations

from signal import SIGINT, SIGKILL, SIGTERM
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tfcompose.plan import PlanEdge
    from tfcompose.run.state import State, Stop, Times, Tracked

#: What a process is told, each when the one before did not help.
STOP_SIGNALS = (SIGINT, SIGTERM, SIGKILL)


def backoff_s(times: Times, failures: int) -> float:
    """Return how long to wait before the restart after so many failures in a row."""
    return min(times.backoff_s * 2.0 ** (failures - 1), times.backoff_limit_s)


def by_owner(edges: tuple[PlanEdge, ...]) -> tuple[tuple[str, tuple[PlanEdge, ...]], ...]:
    """Return each owner with its edges, in the order of the edges."""
    owners = dict.fromkeys(edge.owner for edge in edges)
    return tuple((owner, tuple(edge for edge in edges if edge.owner == owner)) for owner in owners)


def waiting_due(state: State) -> float | None:
    """Return when missing edges are to be named; None if there is nothing new to name."""
    if state.clear is None or state.complete or not state.missing:
        return None
    if state.waiting_said is None:
        return state.clear + state.times.waiting_s
    missing = {edge.child for edge in state.missing}
    return None if missing == state.waiting else state.waiting_said + state.times.waiting_s


def stop_level(state: State, stop: Stop, one: Tracked, now: float) -> int:
    """Return how many of ``STOP_SIGNALS`` the process should have been sent by now.

    The first is due when nothing runs that waits for the process, each further one a while after the one before; a
    second signal to the launcher makes the second due at once, everywhere, and a third the third.
    """
    due = _firmer_at(state.times, one)
    level = one.level + 1 if due is not None and now >= due else one.level
    if level == 0 and not _is_needed(state, one):
        level = 1
    if stop.signals > 1:
        level = max(level, stop.signals)
    return min(level, len(STOP_SIGNALS))


def _firmer_at(times: Times, one: Tracked) -> float | None:
    waits = {1: times.interrupt_s, 2: times.terminate_s}
    return one.since + waits[one.level] if one.state == "STOPPING" and one.level in waits else None


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
        if firmer is not None:
            due.append(firmer)
    if state.stop is None and state.begun is not None:
        if state.clear is None:
            due.append(state.begun + times.clear_s)
        reminder = waiting_due(state)
        if reminder is not None:
            due.append(reminder)
    return min(due, default=None)
