"""TF704: joint without limits."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.diagnostic import Diagnostic, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Robot


def joint_without_limits(robot: Robot) -> Iterator[Diagnostic]:
    """A revolute or prismatic joint does not say how far it goes.

    URDF requires lower and upper limits for these types, and readers refuse the whole robot without them. A joint that
    turns without end is ``continuous``.
    """
    for edge in robot.edges:
        joint = edge.joint
        if joint is None or joint.type == "continuous":
            continue
        limit = joint.limit
        if limit is None or limit.lower is None or limit.upper is None:
            advice = (
                "limit: {lower: -90 deg, upper: 90 deg}"
                if joint.type == "revolute"
                else "limit: {lower: 0, upper: 0.1}"
            )
            yield finding(
                "TF704", f"the {joint.type} joint {joint.name} has no lower and upper limit", joint.at, help=advice
            )
