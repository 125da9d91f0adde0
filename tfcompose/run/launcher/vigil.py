"""Who guards the guard: one that hangs is ended, and started again like one that dies.

It says once a second that it looks. Where that does not come for long, the launcher itself may have been kept from
running; so it waits once more, with its own clock going, before it believes it.
"""

from __future__ import annotations

from signal import SIGKILL
from typing import TYPE_CHECKING

from tfcompose.run.launcher.action import Kill
from tfcompose.run.launcher.failures import guard_hangs

if TYPE_CHECKING:
    from tfcompose.run.launcher.state import State
    from tfcompose.run.launcher.turn import Turn


def heard(turn: Turn) -> None:
    """Note that the guard looks."""
    turn.know(guard_heard=turn.now, guard_doubted=None)


def forget(turn: Turn) -> None:
    """Expect nothing of the guard until it has said once that it looks."""
    turn.know(guard_heard=None, guard_doubted=None)


def keep(turn: Turn) -> None:
    """End a guard that has not been heard for so long that it hangs."""
    due, state = due_at(turn.state), turn.state
    if due is None or turn.now < due or state.guard is None or state.guard_heard is None:
        return
    if state.guard_doubted is None:
        turn.know(guard_doubted=turn.now)
        return
    strict = state.plan.guard.mode == "strict"
    turn.show(guard_hangs(state.guard, turn.now - state.guard_heard, strict=strict))
    turn.actions.append(Kill(state.guard, SIGKILL))
    forget(turn)


def due_at(state: State) -> float | None:
    """Return when the guard is doubted, or believed to hang; None if nothing is expected of it."""
    if state.guard is None or state.guard_heard is None or state.tracked[state.guard].state != "RUNNING":
        return None
    if state.guard_doubted is None:
        return state.guard_heard + state.times.guard_silent_s
    return state.guard_doubted + state.times.guard_doubt_s
