"""Rules about optical frames: each camera has an optical frame, rotated as REP-103 requires."""

from __future__ import annotations

import itertools
import math
import re
from typing import TYPE_CHECKING

from tfcompose.compiler.check.poses import CAMERAS
from tfcompose.compiler.check.rule import rule
from tfcompose.foundation.findings import Finding, finding
from tfcompose.foundation.geometry import (
    IDENTITY_XYZW,
    OPTICAL_XYZW,
    angle_between,
    multiply,
    quat_from_rpy,
    rotate,
)
from tfcompose.model.robot import OPTICAL_ENDINGS, is_optical

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from tfcompose.foundation.geometry import Quaternion
    from tfcompose.model.robot import Edge, Robot

_TOLERANCE_RAD = 2e-3

_QUARTERS = (0.0, math.pi / 2, math.pi, -math.pi / 2)
#: All rotations by right angles, with repetitions.
_RIGHT_ANGLES = tuple(quat_from_rpy(*angles) for angles in itertools.product(_QUARTERS, repeat=3))

#: Names of frames with x forward and z up that do not belong to a camera.
_BASES = frozenset({"base_link", "base_footprint", "base", "chassis_link", "body_link"})
#: Words in the names of camera bodies; then of bodies that hold a camera; then of the last link of
#: an arm, whose z axis points forward.
_CAMERA_WORDS = frozenset(
    {"cam", "camera", "color", "colour", "depth", "lens", "rgb", "rgbd", "stereo"}
)
_HOLDER_WORDS = frozenset(
    {"arm", "bar", "base", "bracket", "holder", "mast", "mount", "plate", "pole", "screw"}
)
_END_OF_ARM = re.compile(
    r"(^|_)(tool\d*|flange|tcp|ee|eef|hand|gripper|wrist|palm|link_?\d+)(_|$)"
)
#: A camera whose optical axis is steeper looks at the sky.
_STEEP_RAD = math.radians(45)


@rule("TF401", of_urdf=True, follows="pose")
def optical_frame_not_rotated(robot: Robot) -> Iterator[Finding]:
    for edge in _edges_turned_otherwise(robot):
        quat_xyzw = edge.pose.quat_xyzw
        if _is_upside_down(edge, robot):
            continue
        off = math.degrees(angle_between(quat_xyzw, OPTICAL_XYZW))
        message = (
            f"{edge.child} is named like an optical frame but not rotated like one: it is"
            f" {off:.2f} deg off"
        )
        advice = f"an optical frame has {_optical_rotation(edge, robot)} in {edge.parent}"
        edits = edge.optical_edits()
        if _is_base(edge.parent, robot) and not _is_at(
            quat_xyzw, IDENTITY_XYZW
        ):  # the intended viewing direction is unknown
            advice, edits = (
                (
                    f"{advice}, if that looks forward; give a camera that looks elsewhere a body"
                    " frame"
                ),
                (),
            )
        yield finding("TF401", message, edge.span, help=advice, edits=edits)


@rule("TF416", of_urdf=True, follows="pose")
def camera_upside_down(robot: Robot) -> Iterator[Finding]:
    for edge in _edges_turned_otherwise(robot):
        if _is_upside_down(edge, robot):
            message = f"{edge.child} looks forward in {edge.parent}, but its image is upside down"
            advice = (
                f"an optical frame has {_optical_rotation(edge, robot)}; if the camera hangs"
                " upside down, turn its body frame by 180 deg about x"
            )
            yield finding("TF416", message, edge.span, help=advice)


def _edges_turned_otherwise(robot: Robot) -> Iterator[Edge]:
    """Yield edges to optical frames whose rotation is not optical and probably unintended."""
    above = {edge.child: edge for edge in robot.edges}
    for edge in robot.edges:
        if (
            edge.kind == "static"
            and edge.pose_known
            and not edge.other_axes
            and not edge.calibration
            and is_optical(edge.child)
            and not is_optical(edge.parent)
            and not _is_optical_in_camera(edge, above)
            and _is_wrong(edge, robot)
        ):
            yield edge


def _is_upside_down(edge: Edge, robot: Robot) -> bool:
    """Return whether a camera looks forward and its image is upside down.

    If the parent is the robot's base, every horizontal viewing direction counts as forward.
    """
    quat_xyzw = edge.pose.quat_xyzw
    view, down = rotate(quat_xyzw, (0.0, 0.0, 1.0)), rotate(quat_xyzw, (0.0, 1.0, 0.0))
    forward = math.hypot(*view[:2]) if _is_base(edge.parent, robot) else view[0]
    return forward > math.cos(_STEEP_RAD) and down[2] > math.cos(_STEEP_RAD)


def _optical_rotation(edge: Edge, robot: Robot) -> str:
    if robot.is_foreign(edge.span):
        return '<origin rpy="-1.5707963267948966 0 -1.5707963267948966"/>'
    return "rpy: [-90 deg, 0, -90 deg]"


def _is_optical_in_camera(edge: Edge, above: Mapping[str, Edge]) -> bool:
    """Return whether the frame has an optical rotation in a frame of its camera.

    The search goes from the frame's parent upwards. It passes frames named after the camera and
    frames that have an optical rotation themselves.
    """
    quat_xyzw, step, passed = edge.pose.quat_xyzw, edge, {edge.child}
    while not _is_at(quat_xyzw, OPTICAL_XYZW):
        upper = above.get(step.parent)
        if (
            upper is None
            or upper.kind != "static"
            or not upper.pose_known
            or upper.child in passed
        ):
            return False
        turned = _is_at(upper.pose.quat_xyzw, OPTICAL_XYZW)
        if not turned and not _is_named_after(edge.child, upper.parent):
            return False
        passed.add(upper.child)
        quat_xyzw, step = multiply(upper.pose.quat_xyzw, quat_xyzw), upper
    return True


def _is_wrong(edge: Edge, robot: Robot) -> bool:
    """Return whether the edge's rotation, which is not optical, is probably a mistake."""
    quat_xyzw, parent = edge.pose.quat_xyzw, edge.parent.rpartition("/")[2]
    if _is_named_after(edge.child, edge.parent):
        return True
    if _END_OF_ARM.search(parent):
        return False
    by_right_angles = any(_is_at(quat_xyzw, rotation) for rotation in _RIGHT_ANGLES)
    if _is_base(edge.parent, robot):
        view, down = rotate(quat_xyzw, (0.0, 0.0, 1.0)), rotate(quat_xyzw, (0.0, 1.0, 0.0))
        level, upright = (
            abs(view[2]) < math.sin(_TOLERANCE_RAD),
            down[2] < -math.cos(_TOLERANCE_RAD),
        )
        return view[2] > math.sin(_STEEP_RAD) or (by_right_angles and level and not upright)
    tokens = {*parent.split("_")}
    is_camera = bool(tokens & _CAMERA_WORDS) and not tokens & _HOLDER_WORDS
    return _is_at(quat_xyzw, IDENTITY_XYZW) or (is_camera and by_right_angles)


def _is_base(frame: str, robot: Robot) -> bool:
    return frame == robot.base or frame.rpartition("/")[2] in _BASES


def _is_at(quat_xyzw: Quaternion, rotation: Quaternion) -> bool:
    return angle_between(quat_xyzw, rotation) <= _TOLERANCE_RAD


def _is_named_after(optical: str, frame: str) -> bool:
    """Return whether ``frame`` is named like the body of the optical frame's camera."""
    return _stem(optical).startswith(_stem(frame))


def _stem(frame: str) -> str:
    """Return the common part of the names of a camera's frame and its optical frame.

    For camera_link and camera_optical_frame that is camera.
    """
    for ending in (*OPTICAL_ENDINGS, "_link", "_frame"):
        if frame.endswith(ending):
            return frame.removesuffix(ending)
    return frame


@rule("TF620")
def camera_without_optical_frame(robot: Robot) -> Iterator[Finding]:
    children = robot.children()
    for sensor in robot.sensors:
        if sensor.kind not in CAMERAS:
            continue
        below: set[str] = set()
        waiting = [sensor.mount]
        while waiting:
            frame = waiting.pop()
            if frame not in below:
                below.add(frame)
                waiting += [edge.child for edge in children.get(frame, ())]
        by_other_names = any(edge.other_axes for edge in robot.edges if edge.child in below)
        if not by_other_names and not any(is_optical(frame) for frame in below):
            message = f"camera {sensor.name} has no optical frame"
            advice = f"add a frame {sensor.name}_optical_frame with rpy: [-90 deg, 0, -90 deg]"
            yield finding("TF620", message, sensor.span, help=advice)
