"""``tfcompose pose``: the pose of B in A, from the spec alone.

Print the pose of B in A from the spec alone. What moves is taken at its nominal pose, a joint at 0.
"""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from tfcompose.cli.compiling import robot_or_code
from tfcompose.cli.options import add_variant
from tfcompose.cli.terminal import complain
from tfcompose.diagnostic import did_you_mean
from tfcompose.emit.numbers import clean
from tfcompose.pose import Pose
from tfcompose.render.pose import pose_json, pose_text

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace

    from tfcompose.model import Robot


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument("file", metavar="FILE", help="the robot file")
    parser.add_argument("a", metavar="A", help="the frame in which the pose is given")
    parser.add_argument("b", metavar="B", help="the frame whose pose it is")
    add_variant(parser)
    parser.add_argument("--format", choices=("text", "json"), default="text", help="default: text")


def run(arguments: Namespace) -> int:
    """Print the pose; exit code 1 if a frame is not there."""
    robot = robot_or_code(arguments.file, arguments)
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
