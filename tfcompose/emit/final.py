"""Final names: the robot as it is on the live tree, with the frame prefix written in front."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tfcompose.model import Robot


def with_final_names(robot: Robot) -> Robot:
    """Return the robot with every frame named as listeners know it. URDF keeps plain names; RViz adds the prefix."""
    if not robot.ros.frame_prefix:
        return robot
    final = robot.final
    allow = tuple(
        (final(parent) if parent in robot.frames else parent, final(child) if child in robot.frames else child)
        for parent, child in robot.guard.allow
    )
    return replace(
        robot,
        frames={final(frame): at for frame, at in robot.frames.items()},
        edges=tuple(
            replace(
                edge,
                parent=final(edge.parent),
                child=final(edge.child),
                switched=tuple(final(parent) for parent in edge.switched),
            )
            for edge in robot.edges
        ),
        base=robot.base and final(robot.base),
        claims=tuple(replace(one, parent=final(one.parent), child=final(one.child)) for one in robot.claims),
        guard=replace(robot.guard, allow=allow),
    )
