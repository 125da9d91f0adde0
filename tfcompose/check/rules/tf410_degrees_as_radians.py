"""TF410: degrees as radians."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from tfcompose.findings import Finding, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Robot


#: Degrees that people write. All but 5 are more than a full turn when read as radians; so many radians nobody means.
ROUND = frozenset({5.0, 10.0, 15.0, 20.0, 30.0, 40.0, 45.0, 50.0, 60.0, 70.0, 75.0, 80.0, 90.0, 100.0, 120.0, 135.0})
ROUND_LIMITS = ROUND | {150.0, 165.0, 170.0, 175.0, 180.0, 185.0, 190.0, 270.0, 350.0, 360.0, 720.0}
#: A full turn, and a little for its rounding.
TURN_RAD = 6.29


def degrees_as_radians(robot: Robot) -> Iterator[Finding]:
    """An angle without a unit is probably meant in degrees.

    A bare number is in radians: 90 is fourteen turns and a bit. The frame ends up turned somehow, and nothing else
    complains. Write the unit, ``90 deg``; an angle that is really meant in radians may carry ``rad``. Limits of turning
    joints may be more than a turn: of these only values that people write in degrees are named.
    """
    turning = {edge.joint.name for edge in robot.edges if edge.joint and edge.joint.type == "revolute"}
    for value in robot.as_written:
        is_limit = value.key == "limit"
        if value.key not in {"rpy", "look", "axis_angle", "limit"} or (is_limit and value.entry not in turning):
            continue
        for index, (number, with_unit) in enumerate(zip(value.numbers, value.with_unit, strict=True)):
            size = abs(number)
            if not with_unit and (size in ROUND_LIMITS if is_limit else size in ROUND or size > TURN_RAD):
                message = f"{value.entry}: {value.key} is {number:g} rad, {number / math.tau:.3g} turns"
                yield finding("TF410", message, value.place(index), help=f"in degrees: {number:g} deg")
