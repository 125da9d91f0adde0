"""Rules about beepers."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.compiler.check.rule import rule
from tfcompose.foundation.findings import Finding, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model.robot import Robot


@rule("ACME101")
def beeper_on_nothing(robot: Robot) -> Iterator[Finding]:
    """Yield a finding where the beeper's frame does not exist."""
    section = robot.sections["acme"]
    if section.value.frame not in robot.frames:
        message = f"the beeper is on {section.value.frame}, which is no frame"
        yield finding("ACME101", message, section.span_of("frame"))
