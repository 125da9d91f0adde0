"""TF203: unknown frame."""

from __future__ import annotations

from itertools import count
from typing import TYPE_CHECKING

from tfcompose.findings import Finding, did_you_mean, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Robot

#: For so many names the nearest one is looked for: among thousands that takes long, and thousands are no slips.
MOST_SEARCHES = 50


def unknown_frame(robot: Robot) -> Iterator[Finding]:
    """An edge names a frame that nothing declares.

    A frame is declared under ``frames`` or ``links``, or by a sensor. A misspelt parent would give a second tree that
    no lookup reaches.
    """
    searches = count(1)
    for edge in robot.edges:
        for parent in (edge.parent, *edge.switched) if edge.given else ():
            if parent not in robot.frames and not robot.excuses(parent):
                near = robot.frames if next(searches) <= MOST_SEARCHES else ()
                advice = did_you_mean(parent, near, f"declare it: frames: {{{parent}: {{}}}}")
                yield finding("TF203", f"{edge.child} hangs on {parent}, which is no frame", edge.at, help=advice)
        if edge.child not in robot.frames and not robot.excuses(edge.child):
            near = robot.frames if next(searches) <= MOST_SEARCHES else ()
            advice = did_you_mean(edge.child, near, f"declare it: links: {{{edge.child}: {{}}}}")
            message = f"the joint {edge.joint_name} moves {edge.child}, which is no link"
            yield finding("TF203", message, edge.child_at or edge.at, help=advice)
