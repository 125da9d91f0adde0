"""TF704: joint without limits."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.findings import Finding, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.findings import Severity
    from tfcompose.model import Robot


def joint_without_limits(robot: Robot) -> Iterator[Finding]:
    """A revolute or prismatic joint does not say how far it goes.

    URDF requires a limit for these types, and readers refuse the whole robot without it. A joint that turns without
    end is ``continuous``. A URDF that somebody else wrote, and that gives effort and velocity only, is a warning:
    readers take 0 for lower and upper, so that planners and simulators hold the joint there.
    """
    for edge in robot.edges:
        joint = edge.joint
        if joint is None or joint.type == "continuous":
            continue
        ends = [end for end in (joint.limit.lower, joint.limit.upper) if end is not None] if joint.limit else []
        lax = joint.limit is not None and joint.at.file in robot.foreign  # where one end may be left out
        if len(ends) == 2 or (lax and ends):  # noqa: PLR2004 (lower and upper)
            continue
        usual = "lower: -90 deg, upper: 90 deg" if joint.type == "revolute" else "lower: 0, upper: 0.1"
        message = f"the {joint.type} joint {joint.name} has no lower and upper limit"
        severity: Severity = "warning" if lax else "error"
        yield finding("TF704", message, joint.at, help=f"limit: {{{usual}}}", severity=severity)
