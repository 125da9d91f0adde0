"""TF204: several roots."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.check.forest import main_root, trees
from tfcompose.findings import Finding, Note, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Robot


def several_roots(robot: Robot) -> Iterator[Finding]:
    """The robot falls into several trees.

    Between frames of two trees there is no transform, so that nobody can reach the frames of the one from the other.
    Give every root but one a parent; a tree that nobody needs can go.
    """
    grown = trees(robot)
    main = main_root(robot, grown)
    for root, frames in grown.items():
        if root != main and len(frames) > 1 and not robot.excuses(root):
            message = f"{root} begins a tree of its own, with {len(frames)} frames: nothing ties it to {main}"
            notes = [Note(f"{main} is the root of the robot's tree", robot.frames[main])]
            yield finding("TF204", message, robot.frames[root], notes=notes, help=f"give {root} a parent")
