"""What a scene of the browser view shows, read from its handles."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.foundation.geometry import Pose

if TYPE_CHECKING:
    from tfcompose.tools.view.scene import RobotScene


def is_owner_shown(scene: RobotScene, owner: str) -> bool:
    """Return whether the scene shows the edges of an owner."""
    return bool(scene._lines[owner].visible)


def body_pose(scene: RobotScene, frame: str) -> Pose:
    """Return where the scene has the body of a frame."""
    w, x, y, z = (float(value) for value in scene._bodies[frame].wxyz)
    px, py, pz = (float(value) for value in scene._bodies[frame].position)
    return Pose((px, py, pz), (x, y, z, w))
