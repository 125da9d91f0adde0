"""TF812: start order loop."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.findings import Finding, Note, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Robot


def start_order_loop(robot: Robot) -> Iterator[Finding]:
    """Processes wait for each other.

    None of them would ever be started.
    """
    waiting = {process.name: process for process in robot.processes}
    while free := [name for name, p in waiting.items() if not any(other in waiting for other in p.after)]:
        for name in free:
            del waiting[name]
    names = list(waiting)
    if names:
        notes = [Note(f"{name} is one of them", waiting[name].at) for name in names[1:]]
        message = f"processes wait for each other: {', '.join(names)}"
        yield finding("TF812", message, waiting[names[0]].at, notes=notes, help="remove one after")
