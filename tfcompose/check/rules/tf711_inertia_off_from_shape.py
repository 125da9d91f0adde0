"""TF711: inertia off from shape."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from tfcompose.findings import Finding, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Robot


TIMES = 10


def inertia_off_from_shape(robot: Robot) -> Iterator[Finding]:
    """A link's inertia is ten times, or a tenth of, what its mass and shape give.

    Usually it is in g mm² or kg cm², about another point than the centre of mass, or copied from another link: arms
    swing wildly in simulation or hardly move. Leave ``inertia`` out, and it is computed. Compared are the sums of the
    principal moments, with the visual and the collision shapes at one density; the nearer one counts.
    """
    for link in robot.links.values():
        inertial = link.inertial
        if inertial is None or not inertial.of_shapes:
            continue
        trace = inertial.tensor[0] + inertial.tensor[3] + inertial.tensor[5]
        ratios = [trace / of_shape for of_shape in inertial.of_shapes if of_shape > 0]
        if not ratios or trace <= 0 or any(1 / TIMES < ratio < TIMES for ratio in ratios):
            continue
        ratio = min(ratios, key=lambda one: abs(math.log(one)))
        message = f"the inertia of {link.name} is {ratio:.3g} times what its mass and shape give"
        advice = "leave inertia out: it is computed; or give it in kg m², about the centre of mass"
        yield finding("TF711", message, inertial.at or link.at, help=advice)
