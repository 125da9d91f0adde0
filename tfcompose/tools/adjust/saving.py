"""Poses of a running robot in the overlay of that robot."""

from __future__ import annotations

import os
from argparse import Namespace
from pathlib import PurePosixPath
from typing import TYPE_CHECKING

from tfcompose.cli.compiling import load_robot
from tfcompose.cli.robot_overlay import RobotOverlay
from tfcompose.foundation.findings import RejectedError, finding
from tfcompose.spec.language import overlay_path
from tfcompose.spec.language.overlay import SETTING

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tfcompose.model.plan import Plan, PlanEdge


def save_poses(
    plan: Plan, edges: Sequence[PlanEdge], file: str, robot: str | None
) -> tuple[str, list[PlanEdge]]:
    """Write the edges' poses into an overlay of the robot file.

    ``robot`` names the overlay; None: the one that the plan was built with, or else this
    computer's. All nudges of a mount are one entry of its history. Returns the overlay's path and
    the edges that did not have their poses there.

    Raises:
        RejectedError: if the file is of another robot, or the overlay cannot give an edge its
            pose; edges before that one are written.
        OSError: if the overlay cannot be written.
    """
    source = load_robot(file)
    if source.data.get("robot") != plan.robot:
        message = f"{file} is not the file of the running robot {plan.robot}"
        span = source.span_of(("robot",))
        raise RejectedError([finding("TF667", message, span, help="name its file with --file")])
    here = os.uname().nodename
    overlays = [
        str(PurePosixPath(file).parent / name)
        for name in plan.overlays
        if not name.startswith(SETTING)
    ]
    folder = PurePosixPath(overlay_path(source, robot or here)).parent
    built_with = [path for path in map(PurePosixPath, overlays) if path.parent == folder]
    robot = robot or next((path.stem for path in built_with), here)
    arguments = Namespace(
        profiles=list(plan.profiles),
        overlays=[path for path in overlays if PurePosixPath(path) not in built_with],
        settings=[
            name.removeprefix(SETTING) for name in plan.overlays if name.startswith(SETTING)
        ],
        arg_values={name: _text(value) for name, value in plan.args.items()},
        trust=False,
    )
    saved = []
    for edge in edges:
        overlay = RobotOverlay.open(file, arguments, robot)
        child = edge.child.removeprefix(plan.ros.frame_prefix)
        if overlay.save(child, edge.pose, "nudge", joins=True):
            saved.append(edge)
    return overlay_path(source, robot), saved


def _text(value: object) -> str:
    """Return an argument's value as on the command line."""
    return str(value).lower() if isinstance(value, bool) else str(value)
