"""``tfcompose pose``: the pose of B in A, from the spec alone."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from tfcompose.cli.compiling import robot_or_code
from tfcompose.cli.terminal import complain
from tfcompose.diagnostic import did_you_mean
from tfcompose.emit.numbers import clean
from tfcompose.pose import Pose
from tfcompose.render.pose import pose_json, pose_text

if TYPE_CHECKING:
    from argparse import Namespace

    from tfcompose.model import Robot


def run(arguments: Namespace) -> int:
    """Print the pose; exit code 1 if a frame is not there."""
    robot = robot_or_code(arguments.file, arguments.profiles)
    if isinstance(robot, int):
        return robot
    for frame in (arguments.a, arguments.b):
        if frame not in robot.frames:
            complain(f"no frame {frame}; {did_you_mean(frame, robot.frames, f'{arguments.file} has other frames')}")
            return 1
    pose = clean(_in_root(robot, arguments.a).inverse() @ _in_root(robot, arguments.b))
    write = pose_json if arguments.format == "json" else pose_text
    sys.stdout.write(write(arguments.a, arguments.b, pose))
    return 0


def _in_root(robot: Robot, frame: str) -> Pose:
    """Return the pose of the frame in its root, nominal where it moves."""
    pose = Pose()
    while edge := robot.parent_edge(frame):
        pose = edge.pose @ pose
        frame = edge.parent
    return pose
