"""What comes of resolving a robot file.

The robot, what was found, and what its parts brought along.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tfcompose.foundation.findings import Allow, Finding, Note
    from tfcompose.model.robot import Robot
    from tfcompose.spec.load import Source


@dataclass(slots=True)
class Collected:
    """What is collected from all parts of a robot, and from their parts.

    ``allows`` are the comments in their files that silence findings. ``notes`` holds, for each
    file that is a part, a note for each use that says as which part; ``sources`` are what the
    robot files among them were resolved from.
    """

    count: int = 0
    allows: list[Allow] = field(default_factory=list)
    notes: dict[str, list[Note]] = field(default_factory=dict)
    sources: list[Source] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class Resolved:
    """The robot, right or wrong, and what was found while resolving it."""

    robot: Robot
    found: tuple[Finding, ...]
    collected: Collected = field(default_factory=Collected)
