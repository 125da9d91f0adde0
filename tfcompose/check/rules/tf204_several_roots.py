"""TF204: several roots."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.diagnostic import Diagnostic, Note, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Robot


def several_roots(robot: Robot) -> Iterator[Diagnostic]:
    """The robot falls into several trees.

    Between frames of two trees there is no transform. Give every root but one a parent; a frame that nobody needs can
    go.
    """
    roots = [root for root in robot.roots() if not robot.excuses(root)]
    if len(roots) > 1:
        notes = [Note(f"{root} is one", robot.frames[root]) for root in roots[:-1]]
        message = f"{len(roots)} roots: {', '.join(roots)}"
        advice = "give all but one a parent"
        yield finding("TF204", message, robot.frames[roots[-1]], notes=notes, help=advice)
