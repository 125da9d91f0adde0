"""How simulated bodies and joints move. Pure functions; seconds, metres and radians."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from tfcompose.geometry import Pose, quat_from_rpy

if TYPE_CHECKING:
    from tfcompose.plan import Sweep


def circle(radius: float, speed: float, time_s: float) -> Pose:
    """Return the pose, in the circle's centre, of a body that drives on it: x = r cos ωt, y = r sin ωt.

    ``speed`` is ω in rad/s, counter-clockwise where positive. The body looks where it goes.
    """
    angle = speed * time_s
    heading = angle + math.copysign(math.pi / 2, speed)
    return Pose((radius * math.cos(angle), radius * math.sin(angle), 0.0), quat_from_rpy(0.0, 0.0, heading))


def swept(sweep: Sweep, start: float, time_s: float) -> float:
    """Return the position (rad or m) of a joint that is at ``start`` at time 0 and moves as the sweep says.

    To and fro it is a sine about the middle, which sets out upwards: the position and its speed have no steps, and the
    speed is π · (upper - lower) / period at most. Round and round the angle is between -π and π.
    """
    phase = math.tau * time_s / sweep.period_s
    if sweep.lower is None or sweep.upper is None:
        return math.remainder(start + phase, math.tau)
    middle, half = (sweep.lower + sweep.upper) / 2, (sweep.upper - sweep.lower) / 2
    if half <= 0:
        return middle
    return middle + half * math.sin(phase + math.asin(max(-1.0, min(1.0, (start - middle) / half))))
