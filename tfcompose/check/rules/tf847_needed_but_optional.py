"""TF847: needed but optional."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.findings import Finding, Note, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Robot


def needed_but_optional(robot: Robot) -> Iterator[Finding]:
    """A process that the robot needs waits for one with ``required: false``.

    When the optional one fails, the other is never started, and that ends everything: then it is not optional at all.
    Say ``required: false`` at both, or at neither.
    """
    optional = {process.name: process for process in robot.processes if process.required is False}
    for process in robot.processes:
        if process.required is False or process.kind == "external":
            continue
        for name, what in process.after.items():
            if name in optional:
                message = f"{process.name} waits until {name} is {what}, and {name} is optional"
                advice = f"required: false at {process.name} too, or leave it out at {name}"
                notes = [Note(f"{name} is not required here", optional[name].at)]
                yield finding("TF847", message, process.at, notes=notes, help=advice)
