"""A pose for people and for programs, always as the pose of B in A."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tfcompose.foundation.geometry import Pose


def pose_text(parent: str, child: str, pose: Pose, when: str = "", decimals: int = 4) -> str:
    """Return the pose of ``child`` in ``parent`` as text.

    The text has metres, the quaternion x y z w, and fixed-axis angles in radians and in degrees.
    Degrees have two decimals fewer than ``decimals``.
    """
    degrees = tuple(math.degrees(angle) for angle in pose.rpy)
    return (
        f"pose of {child} in {parent}{when}\n"
        f"  xyz        [{_row(pose.xyz, decimals)}] m\n"
        f"  quat_xyzw  [{_row(pose.quat_xyzw, decimals)}]\n"
        f"  rpy        [{_row(pose.rpy, decimals)}] rad\n"
        f"             [{_row(degrees, max(decimals - 2, 0))}] deg\n"
    )


def pose_json(parent: str, child: str, pose: Pose, **more: float | None) -> str:
    """Return the pose as a line of JSON, with angles in radians."""
    rpy = tuple(angle + 0.0 for angle in pose.rpy)  # −0 becomes 0
    row = {
        "parent": parent,
        "child": child,
        "xyz": pose.xyz,
        "quat_xyzw": pose.quat_xyzw,
        "rpy": rpy,
    }
    return json.dumps(row | more, ensure_ascii=False) + "\n"


def _row(values: tuple[float, ...], decimals: int) -> str:
    return ", ".join(f"{round(value, decimals) + 0.0:.{decimals}f}" for value in values)
