"""TF731: negative damping."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.findings import Finding, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Robot


def negative_damping(robot: Robot) -> Iterator[Finding]:
    """A joint's damping or friction is negative.

    It would drive the joint instead of slowing it down. Drake refuses such damping, and pinocchio such friction, with
    the whole robot. Both are 0 if left out.
    """
    for edge in robot.edges:
        joint = edge.joint
        if joint is None or joint.dynamics is None:
            continue
        for name, value in (("damping", joint.dynamics.damping), ("friction", joint.dynamics.friction)):
            if value < 0:
                message = f"the {name} of {joint.name} is {value:g}"
                yield finding("TF731", message, joint.at, help="0 or more, or leave it out", severity="warning")
