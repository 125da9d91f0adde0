"""TF705: inverted limits."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.findings import Finding, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Robot


def inverted_limits(robot: Robot) -> Iterator[Finding]:
    """A joint's lower limit is above its upper one.

    No position is allowed: planners find nothing, and simulators refuse the robot or clamp the joint to one end.
    Exchange the two, or check the sign: ``limit: {lower: -90 deg, upper: 90 deg}``.
    """
    for edge in robot.edges:
        joint = edge.joint
        if joint is None or joint.limit is None or joint.limit.lower is None or joint.limit.upper is None:
            continue
        if joint.limit.lower > joint.limit.upper and joint.type != "continuous":
            unit = "m" if joint.type == "prismatic" else "rad"
            message = f"{joint.name}: lower is {joint.limit.lower:g} {unit}, above upper, {joint.limit.upper:g} {unit}"
            yield finding("TF705", message, joint.at, help="exchange lower and upper")
