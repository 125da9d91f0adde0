"""TF209: unused frame."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.check.forest import main_root, trees
from tfcompose.findings import Finding, Note, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Robot


def unused_frame(robot: Robot) -> Iterator[Finding]:
    """A link or a frame hangs on nothing, and nothing hangs on it.

    No joint and no mount uses it, nobody can ask where it is, and a URDF with it is refused. Give it a parent, or
    remove it.
    """
    grown = trees(robot)
    main = main_root(robot, grown)
    for root, frames in grown.items():
        if root != main and len(frames) == 1 and not robot.excuses(root):
            what = "link" if root in robot.links else "frame"
            message = f"the {what} {root} hangs on nothing, and nothing hangs on it"
            notes = [Note(f"{main} is the root of the robot's tree", robot.frames[main])]
            advice = f"give {root} a parent, or remove it"
            yield finding("TF209", message, robot.frames[root], notes=notes, help=advice)
