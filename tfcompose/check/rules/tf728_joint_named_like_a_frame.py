"""TF728: joint named like a frame."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.diagnostic import Diagnostic, Note, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Robot


def joint_named_like_a_frame(robot: Robot) -> Iterator[Diagnostic]:
    """A joint has the name of a link or frame.

    URDF lets both stand. Gazebo makes SDF of it, where links, joints and frames share one name space, and refuses the
    robot: the joint "has a name collision". Call the joint after its link, with ``_joint`` behind it.
    """
    for edge in robot.edges:
        name = edge.joint_name
        if name and name in robot.frames:
            kind = "link" if name in robot.links else "frame"
            notes = [Note(f"the {kind} stands here", robot.frames[name])]
            message = f"{name} is a joint and a {kind}"
            yield finding("TF728", message, edge.joint_at or edge.at, help=f"for example {name}_joint", notes=notes)
