"""TF302: unknown owner."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.diagnostic import Diagnostic, did_you_mean, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Robot


def unknown_owner(robot: Robot) -> Iterator[Diagnostic]:
    """An edge names an owner that is no process.

    An owner is a process of the plan: one under ``processes``, a sensor with a driver, or the built-in ``static`` and
    ``joints``. A process that somebody else starts is declared with ``external: true``.
    """
    names = [process.name for process in robot.processes]
    for edge in robot.edges:
        if edge.owner not in names and not robot.excuses(edge.owner):
            advice = did_you_mean(edge.owner, names, f"processes: {{{edge.owner}: {{external: true}}}}")
            message = f"the owner of {edge.name} is {edge.owner}, which is no process"
            yield finding("TF302", message, edge.owner_at or edge.at, help=advice)
