"""TF716: soft limit outside."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.findings import Finding, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Robot


def soft_limit_outside(robot: Robot) -> Iterator[Finding]:
    """A safety controller's soft limits are not inside the joint's limits, or leave no room.

    The controller begins to hold the joint back at the soft limits; beyond the hard ones it does so too late, or never.
    Left out, both are 0, as in URDF.
    """
    for edge in robot.edges:
        joint = edge.joint
        safety, limit = (joint.safety, joint.limit) if joint else (None, None)
        if joint is None or safety is None:
            continue
        low, high = safety.soft_lower_limit, safety.soft_upper_limit
        hard = (limit.lower, limit.upper) if limit else (None, None)
        inside = (hard[0] is None or hard[0] <= low) and (hard[1] is None or high <= hard[1])
        if joint.type != "continuous" and not (inside and low < high):
            message = f"the soft limits of {joint.name}, {low:g} to {high:g}, are not within its limits"
            advice = "soft_lower_limit and soft_upper_limit between lower and upper"
            yield finding("TF716", message, joint.at, help=advice, severity="warning")
