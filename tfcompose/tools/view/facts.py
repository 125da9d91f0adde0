"""Lines of text about a frame of a robot."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from tfcompose.compiler.provenance import values_of
from tfcompose.foundation.numbers import clean_rpy

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tfcompose.foundation.geometry import Pose
    from tfcompose.model.robot import Robot
    from tfcompose.spec.load import Source


def numbers(pose: Pose) -> str:
    """Return a pose as text, in mm and degrees."""
    x, y, z = (f"{value * 1000:.4g}" for value in pose.xyz)
    roll, pitch, yaw = (f"{math.degrees(angle):.4g}" for angle in clean_rpy(pose.quat_xyzw))
    return f"{x}, {y}, {z} mm · {roll}, {pitch}, {yaw} deg"


def facts_of(robot: Robot, sources: Sequence[Source], frame: str) -> list[str]:
    """Return the parent, owner and pose of a frame, and the locations of its values."""
    edge = robot.parent_edge(frame)
    if edge is None:
        return [f"{frame} is a root ({robot.frames[frame]})"]
    values = values_of(edge, sources) or [str(edge.span)]
    return [f"{frame} in {edge.parent}, {edge.kind}, by {edge.owner}", numbers(edge.pose), *values]
