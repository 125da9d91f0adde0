"""TF413: camera looks away."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from tfcompose.check.geometry import CAMERAS, placed
from tfcompose.findings import Finding, finding
from tfcompose.geometry import rotate
from tfcompose.model import is_optical

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Robot


#: Words in a name, the sign of z that they promise, and how far (sine) the view may be on the other side. "up" and
#: "down" may also mean the upper and the lower camera, and so must be clearly contradicted.
WORDS = {
    "floor": (-1, 0.1),
    "ground": (-1, 0.1),
    "downward": (-1, 0.1),
    "downwards": (-1, 0.1),
    "down": (-1, 0.5),
    "ceiling": (1, 0.1),
    "upward": (1, 0.1),
    "upwards": (1, 0.1),
    "up": (1, 0.5),
}
#: Above this a camera named after the ceiling probably hangs there.
OVERHEAD_M = 1.5


def camera_looks_away(robot: Robot) -> Iterator[Finding]:
    """A camera looks up and its name says floor, or looks down and its name says ceiling.

    By REP-103 looking down is *positive* pitch, which many get wrong once. Write what is meant:
    ``look: {down: 30 deg}``. Judged is the optical axis in the robot's base, for cameras that are fixed to it.
    """
    base = (robot.base or "").rpartition("/")[2]
    poses = placed(robot) if base.startswith("base") and robot.sensors else {}
    for sensor in robot.sensors:
        said = next((WORDS[word] for word in reversed(sensor.name.split("_")) if word in WORDS), None)
        if said is None or sensor.kind not in CAMERAS or sensor.mount not in poses:
            continue
        optical = next((frame for frame in sensor.frames if is_optical(frame) and frame in poses), None)
        pose = poses[optical or sensor.mount]
        axis = rotate(pose.quat_xyzw, (0.0, 0.0, 1.0) if optical else (1.0, 0.0, 0.0))
        sign, tolerance = said
        hangs = "ceiling" in sensor.name and pose.xyz[2] > OVERHEAD_M
        if axis[2] * sign < -tolerance and not hangs:
            angle = math.degrees(math.asin(min(1.0, abs(axis[2]))))
            message = f"{sensor.name} looks {angle:.0f} deg {'up' if axis[2] > 0 else 'down'}"
            advice = f"look: {{{'down' if sign < 0 else 'up'}: {angle:.0f} deg}}; looking down is positive pitch"
            yield finding("TF413", message, sensor.at, help=advice)
