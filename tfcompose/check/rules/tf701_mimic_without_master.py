"""TF701: mimic without master."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.findings import Finding, did_you_mean, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Robot


def mimic_without_master(robot: Robot) -> Iterator[Finding]:
    """A joint follows a joint that is not there or does not move.

    Its frame would never appear: nobody sends a position for a joint that is fixed or misspelt. Name a joint that
    moves, or leave ``mimic`` out.
    """
    joints = [edge.joint for edge in robot.edges if edge.joint]
    names = {joint.name for joint in joints}
    fixed = {edge.joint_name for edge in robot.edges if edge.joint_name} - names
    for joint in joints:
        if joint.mimic is not None and joint.mimic not in names and not robot.excuses(joint.mimic):
            message = f"{joint.name} follows {joint.mimic}, which is {'fixed' if joint.mimic in fixed else 'no joint'}"
            advice = "follow a joint that moves, or leave mimic out"
            if joint.mimic not in fixed:
                advice = did_you_mean(joint.mimic, sorted(names - {joint.name}), advice)
            yield finding("TF701", message, joint.at, help=advice)
