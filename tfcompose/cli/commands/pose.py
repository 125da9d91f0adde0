"""``tfcompose pose``: the pose of B in A, from the spec alone.

Print the pose of B in A from the spec alone. What moves is taken at its nominal pose, a joint at 0.
"""

from __future__ import annotations

import sys
from functools import reduce
from typing import TYPE_CHECKING

from tfcompose.cli.between import edges_between
from tfcompose.cli.compiling import robot_or_code
from tfcompose.cli.options import add_variant
from tfcompose.geometry import Pose
from tfcompose.numbers import clean
from tfcompose.render.pose import pose_json, pose_text

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace

    from tfcompose.model import Edge


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
    edges = edges_between(robot, arguments.a, arguments.b)
    if edges is None:
        return 1
    pose = clean(_in_top(edges[0]).inverse() @ _in_top(edges[1]))
    if arguments.format == "json":
        sys.stdout.write(pose_json(arguments.a, arguments.b, pose))
    else:
        sys.stdout.write(pose_text(arguments.a, arguments.b, pose) + _moving([*edges[0], *reversed(edges[1])]))
    return 0


def _in_top(chain: list[Edge]) -> Pose:
    """Return the pose of the chain's first frame in its last edge's parent, nominal where it moves."""
    return reduce(lambda pose, edge: edge.pose @ pose, chain, Pose())


def _moving(edges: list[Edge]) -> str:
    """Return the line that says what moves on the way, and where it was taken; nothing if nothing does."""
    joints = [edge.joint_name for edge in edges if edge.kind == "joint"]
    others = [edge.name for edge in edges if edge.kind == "dynamic"]
    said = [f"{'joints' if joints[1:] else 'joint'} {', '.join(joints)} at 0"] if joints else []
    said += [f"{', '.join(others)} at {'their nominal poses' if others[1:] else 'its nominal pose'}"] if others else []
    return f"  with       {' and '.join(said)}\n" if said else ""
