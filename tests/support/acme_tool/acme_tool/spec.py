"""The section acme of a robot file, and the process that it adds."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.foundation.units import Size
from tfcompose.model.robot import Process
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
        at=section.at_key(),
        argv=("sleep", f"{section.value.reach:g}"),
        required=False,
    )
