"""TF707: axis not unit."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.findings import Finding, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Robot


#: What two written decimals can be off: [0.71, 0.71, 0] has length 1.004.
TOLERANCE = 0.02


def axis_not_unit(robot: Robot) -> Iterator[Finding]:
    """A joint's axis does not have length 1.

    An axis is a direction. tfcompose normalises it; other readers of a URDF scale the motion by its length, and often a
    digit or a sign was lost. Write [0, 0, 1], or [0.7071, 0, 0.7071].
    """
    for edge in robot.edges:
        joint = edge.joint
        if joint and abs(joint.axis_length - 1) > TOLERANCE:
            axis = ", ".join(f"{part:.4g}" for part in joint.axis)
            message = f"{joint.name}: the axis has length {joint.axis_length:.4g}, not 1"
            yield finding("TF707", message, joint.at, help=f"of length 1: [{axis}]")
