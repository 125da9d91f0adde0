"""Print the pose of frame B in frame A, from the robot file alone.

Print the pose of B in A from the robot file. Moving frames are at their nominal pose, joints at
0.
"""

from __future__ import annotations

import sys
from functools import reduce
from typing import TYPE_CHECKING

from tfcompose.cli.options import add_file, add_format, add_frames, add_variant
from tfcompose.cli.terminal import UNREADABLE, fail
from tfcompose.foundation.geometry import Pose

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace

    from tfcompose.model.robot import Edge


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    add_file(parser)
    add_frames(parser)
    add_variant(parser)
    add_format(parser)


def run(arguments: Namespace) -> int:
    """Print the pose. Return 1 if a frame does not exist, or if only a driver knows the pose."""
    from tfcompose.cli.compiling import compile_or_exit, edges_between
    from tfcompose.compiler.render.pose import pose_json, pose_text
    from tfcompose.foundation.numbers import clean

    if arguments.a.endswith((".yaml", ".yml")):
        fail("pose takes [FILE] A B: a second frame is missing", UNREADABLE)
    rising, falling = edges_between(
        compile_or_exit(arguments.file, arguments), arguments.a, arguments.b
    )
    unknown = next((edge for edge in [*rising, *reversed(falling)] if not edge.pose_known), None)
    if unknown:
        fail(
            f"only {unknown.owner} knows where {unknown.child} is in {unknown.parent}: "
            f"tfcompose echo {arguments.a} {arguments.b} reads it from the running robot"
        )
    pose = clean(_pose_in_top(rising).inverse() @ _pose_in_top(falling))
    if arguments.format == "json":
        sys.stdout.write(pose_json(arguments.a, arguments.b, pose))
    else:
        sys.stdout.write(
            pose_text(arguments.a, arguments.b, pose) + _moving([*rising, *reversed(falling)])
        )
    return 0


def _pose_in_top(chain: list[Edge]) -> Pose:
    """Return the pose of the chain's first frame in its last parent.

    Moving edges have their nominal pose.
    """
    return reduce(lambda pose, edge: edge.pose @ pose, chain, Pose())


def _moving(edges: list[Edge]) -> str:
    """Return a line that names the moving edges in the chain and their assumed poses.

    Return an empty text if no edge moves.
    """
    joints = [edge.joint_name for edge in edges if edge.kind == "joint"]
    dynamic = [edge.name for edge in edges if edge.kind == "dynamic"]
    parts = [f"{'joints' if joints[1:] else 'joint'} {', '.join(joints)} at 0"] if joints else []
    parts += (
        [f"{', '.join(dynamic)} at {'their nominal poses' if dynamic[1:] else 'its nominal pose'}"]
        if dynamic
        else []
    )
    return f"  with       {' and '.join(parts)}\n" if parts else ""
