"""Check of the ``frame_id`` in messages against the frame that the robot file declares."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.foundation.findings import did_you_mean
from tfcompose.foundation.geometry import OPTICAL_XYZW, angle_between, multiply
from tfcompose.model.robot import is_optical
from tfcompose.tools.prove.messages import CLOUDS, IMAGES
from tfcompose.tools.prove.verdict import CheckResult

if TYPE_CHECKING:
    from collections.abc import Mapping

    from tfcompose.foundation.geometry import Pose
    from tfcompose.model.robot import Robot
    from tfcompose.tools.prove.messages import MeasuredTopic

CHECK = "frame"
#: The largest angle in radians between x of a camera's body frame and its viewing direction.
_NEAR_RAD = 0.35


def judge_frame(
    robot: Robot, topic: MeasuredTopic, declared: str, base_from_frames: dict[str, Pose]
) -> CheckResult:
    """Compare the frame in a topic's messages with the declared frame.

    ``declared`` is the frame that the driver should use, with the robot's prefix. It is empty if
    the file does not declare a frame.
    """
    finals = {robot.final(name): name for name in robot.frames}
    frame = topic.frame
    if len(topic.frames) > 1:
        return _judge_frames(topic, declared, finals)
    if frame not in finals:
        text = f"has frame_id {frame or '(empty)'}, which the file does not declare"
        expected = declared or "a declared frame"
        advice = did_you_mean(frame, finals, f"let the driver use {expected}")
        return CheckResult(CHECK, "differs", text, "TF652", advice)
    if declared and frame != declared:
        text = f"has frame_id {frame} instead of {declared}"
        advice = f"set the driver's frame to {declared}, or change the sensor in the file"
        return CheckResult(CHECK, "differs", text, "TF652", advice)
    if topic.type in IMAGES and not _is_optical(robot, finals[frame], base_from_frames):
        text = f"sends images with frame_id {frame}, which is not an optical frame"
        optical = [
            robot.final(edge.child)
            for edge in robot.edges
            if edge.parent == finals[frame] and is_optical(edge.child)
        ]
        expected = optical[0] if optical else "an optical frame: z forward, x right, y down"
        advice = f"let the driver use {expected} (REP-103)"
        return CheckResult(CHECK, "differs", text, "TF652", advice)
    return CheckResult(CHECK, "agrees", frame)


def _judge_frames(topic: MeasuredTopic, declared: str, finals: Mapping[str, str]) -> CheckResult:
    """Return the result for a topic on which messages of different frames come, most first.

    Clouds of different sensors may share a topic.
    """
    counts = sorted((-count, frame) for frame, count in topic.frames.items())
    named = f"has frame_id {' and '.join(frame or '(empty)' for _, frame in counts)}"
    if topic.type in CLOUDS and not declared and finals.keys() >= topic.frames.keys():
        return CheckResult(CHECK, "cannot tell", f"{topic.name} {named}")
    advice = "let each driver use its own topic, and the frame that the file declares"
    return CheckResult(CHECK, "differs", f"{named} on {topic.name}", "TF652", advice)


def _is_optical(robot: Robot, frame: str, base_from_frames: dict[str, Pose]) -> bool:
    """Return whether a frame is optical by its name, its preset, or its rotation."""
    if is_optical(frame):
        return True
    if any(
        optics.kind == "camera" and optics.frame == frame
        for sensor in robot.sensors
        for optics in sensor.optics
    ):
        return True
    edge = robot.parent_edge(frame)
    if edge is None or frame not in base_from_frames:
        return False
    x, y, z, w = OPTICAL_XYZW
    body = multiply(base_from_frames[frame].quat_xyzw, (-x, -y, -z, w))
    return (
        angle_between(edge.pose.quat_xyzw, OPTICAL_XYZW) < _NEAR_RAD
        or angle_between(body, (0.0, 0.0, 0.0, 1.0)) < _NEAR_RAD
    )
