"""TF715: joint without owner."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.findings import Finding, finding
from tfcompose.model import BUILT_IN

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Robot


def joint_without_owner(robot: Robot) -> Iterator[Finding]:
    """A planar or floating joint is nobody's.

    Joint states hold one position a joint, and these have two and six: neither tfcompose nor robot_state_publisher can
    place the child. Name the process that publishes the edge as its owner: odometry, a simulator, or a stand-in
    (simulate: {fixed: {}}).
    """
    for edge in robot.edges:
        joint = edge.free
        if joint and edge.owner in BUILT_IN:
            message = f"the {joint.type} joint {joint.name} has no owner: joint states cannot place {edge.child}"
            advice = "owner: the process that publishes it"
            if joint.at.file in robot.foreign:  # which cannot say it
                advice = "tfcompose import makes a robot file of it, where the joint can have an owner: spec: FILE"
            yield finding("TF715", message, edge.owner_at or joint.at, help=advice)
