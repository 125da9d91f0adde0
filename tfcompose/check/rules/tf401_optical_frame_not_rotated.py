"""TF401: optical frame not rotated."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from tfcompose.findings import Finding, finding
from tfcompose.geometry import IDENTITY_XYZW, OPTICAL_XYZW, angle_between
from tfcompose.model import OPTICAL_ENDINGS, is_optical

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Robot


TOLERANCE_RAD = 2e-3


def optical_frame_not_rotated(robot: Robot) -> Iterator[Finding]:
    """An optical frame is not turned into the viewing direction.

    By REP-103 an optical frame has z forward, x right and y down, and its body frame x forward, y left and z up. The
    rotation between the two is rpy [-90 deg, 0, -90 deg]. Without it, point clouds stand upright on their side. Rounded
    constants (−1.57) are let through: they are off by 0.0011 rad each. So are frames of a preset whose vendor has other
    axes (RealSense T265).
    """
    for edge in robot.edges:
        if edge.kind != "static" or edge.other_axes or not is_optical(edge.child) or is_optical(edge.parent):
            continue
        off = angle_between(edge.pose.quat_xyzw, OPTICAL_XYZW)
        is_body = _stem(edge.child).startswith(_stem(edge.parent))
        unturned = angle_between(edge.pose.quat_xyzw, IDENTITY_XYZW) <= TOLERANCE_RAD
        if off > TOLERANCE_RAD and (is_body or unturned):
            message = f"{edge.child} is no optical frame: it is {math.degrees(off):.2f} deg off the optical rotation"
            advice = f"in {edge.parent} an optical frame has rpy: [-90 deg, 0, -90 deg]"
            yield finding("TF401", message, edge.at, help=advice)


def _stem(frame: str) -> str:
    """Return what a frame and its optical twin have in common: camera_link, camera_optical_frame → camera."""
    for ending in (*OPTICAL_ENDINGS, "_link", "_frame"):
        if frame.endswith(ending):
            return frame.removesuffix(ending)
    return frame
