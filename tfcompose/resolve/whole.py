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

    ``allows`` are the comments that let findings in their files stand. ``foreign`` are the files that somebody else
    wrote, and ``own`` the robot files that are parts, with a note for each use that says as which part; ``sources`` are
    what the latter were resolved from.
    """

    count: int = 0
    allows: list[Allow] = field(default_factory=list)
    foreign: dict[str, list[Note]] = field(default_factory=dict)
    own: dict[str, list[Note]] = field(default_factory=dict)
    sources: list[Source] = field(default_factory=list)
