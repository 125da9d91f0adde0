"""The section acme of a robot file, what it adds to the plan, and a file of beepers."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.foundation.findings import Finding, finding
from tfcompose.foundation.units import Size
from tfcompose.model.plan import PROGRAM
from tfcompose.model.robot import Process, Robot
from tfcompose.spec.language.spec import Spec, key
from tfcompose.spec.language.values import Text

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.compiler.resolve.tool_sections import ToolSection


class AcmeSpec(Spec):
    """A beeper on a frame."""

    frame: Text = key(..., "the frame that it is on", "base_link")
    reach: Size = key(1.0, "how far it is heard", "2 m")


def beeper(section: ToolSection) -> Iterator[Process]:
    """Yield the process that beeps."""
    yield Process(
        "beeper",
        "run",
        span=section.key_span(),
        argv=(PROGRAM, "beep", "${plan}"),
        required=False,
    )


class BeepersSpec(Spec):
    """Several beepers."""

    beepers: dict[Text, AcmeSpec] = key(..., "beepers by name", {"b": {"frame": "base_link"}})


#: What a beeper reaches at most, in metres.
MOST_M = 100


def far_beeper(section: ToolSection, robot: Robot) -> Iterator[Finding]:
    """Yield a finding where the beeper is said to reach too far."""
    if section.value.reach > MOST_M:
        message = f"the beeper of {robot.name} does not reach {section.value.reach:g} m"
        yield finding("ACME102", message, section.span_of("reach"))
