"""What a violation leads to: it is told, and by the plan's policy the offender is stopped, or everything."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from tfcompose.findings import Note
from tfcompose.ipc import ProcessRequest
from tfcompose.run.launcher.failures import in_short
from tfcompose.run.launcher.lives import asked, refusal
from tfcompose.run.launcher.state import Stop

if TYPE_CHECKING:
    from tfcompose.findings import Finding
    from tfcompose.run.launcher.turn import Turn


def judged(turn: Turn, found: Finding, process: str) -> None:
    """Take what the guard found; ``process`` is the plan's own that surely did it, or empty."""
    policy = turn.state.plan.guard.on_violation
    if found.severity != "error" or policy == "report":
        turn.show(found)
    elif policy == "stop":
        turn.show(found)
        turn.stop(Stop("failure", 1), in_short(found))
    elif not process:
        turn.show(found)
    elif why := refusal(turn.state, process, "stop"):
        turn.show(_noted(found, f"nothing is stopped: {why}"))
    else:
        turn.show(_noted(found, f"{process} is stopped for it, and stays so: on_violation is stop-offender"))
        asked(turn, ProcessRequest("stop", process))


def _noted(found: Finding, text: str) -> Finding:
    return replace(found, notes=(*found.notes, Note(text)))
