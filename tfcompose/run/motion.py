"""How simulated bodies and joints move. Pure functions; seconds, metres and radians."""

from __future__ import annotations

import math

from tfcompose.pose import Pose, quat_from_rpy


def circle(radius: float, speed: float, time_s: float) -> Pose:
    """Return the pose, in the circle's centre, of a body that drives on it: x = r cos ωt, y = r sin ωt.

    ``speed`` is ω in rad/s, counter-clockwise where positive. The body looks where it goes.
    """
    angle = speed * time_s
    heading = angle + math.copysign(math.pi / 2, speed)
    return Pose((radius * math.cos(angle), radius * math.sin(angle), 0.0), quat_from_rpy(0.0, 0.0, heading))
