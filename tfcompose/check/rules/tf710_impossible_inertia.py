"""TF710: impossible inertia."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from tfcompose.findings import Finding, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Robot


#: What rounding to three digits may be off.
TOLERANCE = 0.01


def impossible_inertia(robot: Robot) -> Iterator[Finding]:
    """No body has such an inertia: it is not positive definite, or one moment exceeds the sum of the others.

    Simulators refuse it (MuJoCo, Gazebo), or the joint explodes. Usually a sign was lost, moments were exchanged with
    products, or all are 0. Leave ``inertia`` out, and it is computed from mass and shape; or take the values from CAD,
    about the centre of mass.
    """
    for link in robot.links.values():
        inertial = link.inertial
        if inertial is None or inertial.at is None:
            continue
        low, middle, high = _principal(inertial.tensor)
        why = ""
        if low <= 0:
            why = f"its least principal moment is {low:.3g}"
        elif high > (low + middle) * (1 + TOLERANCE):
            why = f"{high:.3g} is more than {low:.3g} + {middle:.3g}"
        if why:
            message = f"no body has the inertia of {link.name}: {why} kg m²"
            advice = "leave inertia out: it is computed from mass and shape"
            yield finding("TF710", message, inertial.at, help=advice)


def _principal(tensor: tuple[float, float, float, float, float, float]) -> tuple[float, float, float]:
    """Return the eigenvalues of the symmetric tensor xx, xy, xz, yy, yz, zz, least first (Smith, 1961)."""
    scale = max(map(abs, tensor)) or 1.0  # squares of what a foreign file holds may leave the range of floats
    xx, xy, xz, yy, yz, zz = (value / scale for value in tensor)
    mean = (xx + yy + zz) / 3
    spread = math.sqrt(((xx - mean) ** 2 + (yy - mean) ** 2 + (zz - mean) ** 2 + 2 * (xy**2 + xz**2 + yz**2)) / 6)
    if spread <= abs(mean) * 1e-12:
        return (mean * scale, mean * scale, mean * scale)
    a, b, c, d, e, f = (
        (xx - mean) / spread,
        xy / spread,
        xz / spread,
        (yy - mean) / spread,
        yz / spread,
        (zz - mean) / spread,
    )
    half = (a * (d * f - e * e) - b * (b * f - e * c) + c * (b * e - d * c)) / 2
    angle = math.acos(max(-1.0, min(1.0, half))) / 3
    high, low = mean + 2 * spread * math.cos(angle), mean + 2 * spread * math.cos(angle + math.tau / 3)
    return (low * scale, (3 * mean - high - low) * scale, high * scale)
