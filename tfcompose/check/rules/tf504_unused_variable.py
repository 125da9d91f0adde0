"""TF504: unused variable."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.findings import Finding, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Robot


def unused_variable(robot: Robot) -> Iterator[Finding]:
    """Nothing uses a variable.

    Probably the number still stands where the variable was meant to go, and changing the variable changes nothing. Use
    it, ``"${mast}"``, or remove it. Variables that only a profile uses, or that an included file brings, are left
    alone.
    """
    for name, at in robot.unused.items():
        if at.file == robot.file and ("vars", name) not in robot.broken:
            yield finding("TF504", f"nothing uses the variable {name}", at, help="remove it")
