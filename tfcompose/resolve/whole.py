"""What all parts of a robot have in common."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tfcompose.findings import Allow, Note
    from tfcompose.load import Source


@dataclass(slots=True)
class Whole:
    """What is known of all parts of a robot, and of theirs, together.

    ``allows`` are the comments in their files that silence findings. ``notes`` holds, for each file that is a part, a
    note for each use that says as which part; ``sources`` are what the robot files among them were resolved from.
    """

    count: int = 0
    allows: list[Allow] = field(default_factory=list)
    notes: dict[str, list[Note]] = field(default_factory=dict)
    sources: list[Source] = field(default_factory=list)
