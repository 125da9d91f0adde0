"""TF206: no frames."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.findings import Finding, Span, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Robot


def no_frames(robot: Robot) -> Iterator[Finding]:
    """The robot has no frames.

    There is nothing to publish and nothing to describe. A robot has at least a ``base_link``, under ``links``.
    """
    if not robot.frames and not robot.broken:
        yield finding(
            "TF206", f"{robot.name or 'the robot'} has no frames", Span(robot.file), help="links: {base_link: {}}"
        )
