"""TF411: rounded right angle."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from tfcompose.findings import Finding, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Robot


#: 1.5708 is good enough: 0.0002 degrees off, less than any mount is true to.
GOOD_RAD, ROUNDED_RAD, NOISE = 5e-6, 2e-3, 2e-9
QUARTERS = {1: "pi/2", 2: "pi", 3: "3*pi/2", 4: "2*pi"}
MOST_DECIMALS = 6


def rounded_right_angle(robot: Robot) -> Iterator[Finding]:
    """An angle is π/2 or π with too few digits.

    −1.57 misses the right angle by 0.05 degrees: 0.8 mm at one metre. Two such frames no longer cancel out, and every
    point cloud is tilted a little. Write ``-90 deg``, or ``"${-pi/2}"``. Only roundings of the right angle are named: a
    measured 1.5689 can stand.
    """
    for value in robot.as_written:
        if value.key not in {"rpy", "look", "axis_angle"}:
            continue
        rounded = [(n, index) for index, n in enumerate(value.numbers) if _is_rounded(n)]
        if rounded:
            number, first = rounded[0]
            quarters = round(number / (math.pi / 2))
            sign = "-" if number < 0 else ""
            off = math.degrees(abs(number - quarters * math.pi / 2))
            said = ", ".join(dict.fromkeys(f"{n:g}" for n, _ in rounded))
            message = f"{value.entry}: {value.key} has {said}, {off:.2g} deg off {quarters * 90} deg"
            advice = f'write {quarters * 90} deg, or "${{{sign}{QUARTERS[abs(quarters)]}}}"'
            yield finding("TF411", message, value.place(first), help=advice)


def _is_rounded(number: float) -> bool:
    """Whether the number is a rounding, up or down, of a multiple of π/2, and not that multiple itself."""
    quarters = round(number / (math.pi / 2))
    exact = quarters * math.pi / 2
    if abs(quarters) not in QUARTERS or not GOOD_RAD < abs(number - exact) / max(1, abs(quarters)) < ROUNDED_RAD:
        return False
    return any(
        abs(number * 10**decimals - whole(exact * 10**decimals)) < NOISE
        for decimals in range(2, MOST_DECIMALS)
        for whole in (math.floor, math.ceil)
    )
