"""TF412: quaternion w first."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from tfcompose.findings import Finding, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Robot


#: A w of this and more is a turn of less than 64 degrees.
SMALL_TURN_W = 0.85


def quaternion_w_first(robot: Robot) -> Iterator[Finding]:
    """A quaternion looks as if it had w in front; the order is x, y, z, w.

    Eigen's constructor, MATLAB and many papers put w first. [1, 0, 0, 0] is no turn there, and a half turn about x
    here: the sensor hangs upside down. Move the first number to the end. If the half turn is meant, write
    ``rpy: [180 deg, 0, 0]``. Named are [1, 0, 0, 0] itself, and quaternions that are a plain small pitch or yaw when
    read with w first and an odd large turn otherwise.
    """
    for value in robot.as_written:
        if value.key != "quat_xyzw" or len(value.numbers) != 4:  # noqa: PLR2004 (x, y, z, w)
            continue
        first, second, third, fourth = value.numbers
        identity = abs(first) == 1 and not (second or third or fourth)
        small = SMALL_TURN_W < abs(first) < 1 and second == 0 and (third == 0) != (fourth == 0)
        if identity or small:
            ways = f"a turn of {_degrees(fourth)} deg, and with w first one of {_degrees(first)} deg"
            message = f"{value.entry}: quat_xyzw {_shown(value.numbers)} is {ways}"
            advice = f"x, y, z, w: {_shown((second, third, fourth, first))}"
            if identity:
                advice += "; if the half turn is meant, rpy: [180 deg, 0, 0]"
            yield finding("TF412", message, value.place(0), help=advice)


def _degrees(w: float) -> str:
    return f"{math.degrees(2 * math.acos(min(1.0, abs(w)))):.0f}"


def _shown(numbers: tuple[float, ...]) -> str:
    return f"[{', '.join(f'{number:g}' for number in numbers)}]"
