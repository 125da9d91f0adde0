"""What must have happened before a process is started: ``after``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.run.launcher.failures import waits_in_vain

if TYPE_CHECKING:
    from tfcompose.run.launcher.state import State, Tracked
    from tfcompose.run.launcher.turn import Turn


def unmet(state: State, one: Tracked) -> tuple[tuple[str, str], ...]:
    """Return the processes that this one still waits for, each with what it is to be."""
    return tuple((name, what) for name, what in one.process.after.items() if not _is_there(state.tracked[name], what))


def unmet_in_words(state: State, one: Tracked) -> str:
    """Return what a process that was not started waits for: "slam to be ready and map to be done", or ""."""
    return " and ".join(f"{name} to be {what}" for name, what in unmet(state, one))


def give_up_waiting(turn: Turn) -> None:
    """Have those fail that wait for what cannot come any more."""
    for name, one in turn.state.tracked.items():
        if one.state != "STOPPED" or not one.wanted or one.failed:
            continue
        for other, what in unmet(turn.state, one):
            found = turn.state.tracked[other]
            if found.failed or found.state == "EXITED":
                turn.failed(name, waits_in_vain(name, other, what, "has failed" if found.failed else "has ended"))
                break


def _is_there(other: Tracked, what: str) -> bool:
    if what == "ready":
        return other.ready
    if what == "done":
        return other.state == "EXITED" and not other.failed
    return other.was_started or other.state == "EXPECTED"
