"""TF728: joint named like a frame."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.findings import Finding, Note, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Robot

SHOWN = 5


def joint_named_like_a_frame(robot: Robot) -> Iterator[Finding]:
    """A joint has the name of a link or frame.

    URDF lets both stand. Gazebo makes SDF of it, where links, joints and frames share one name space, and refuses the
    robot: the joint "has a name collision". Call the joint after its link, with ``_joint`` behind it. All of a
    robot are one finding.
    """
    named = {edge.joint_name: edge.joint_at or edge.at for edge in robot.edges if edge.joint_name in robot.frames}
    named.pop("", None)
    if named:
        first, *others = named
        kind = "link" if first in robot.links else "frame"
        notes = [Note(f"the {kind} stands here", robot.frames[first])]
        notes += [Note(f"{name} is another", named[name]) for name in others[:SHOWN]]
        more = f", and so {'are' if others[1:] else 'is'} {len(others)} more" if others else ""
        message = f"{first} is a joint and a {kind}{more}"
        yield finding("TF728", message, named[first], help=f"for example {first}_joint", notes=notes)
