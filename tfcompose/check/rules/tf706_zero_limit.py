"""TF706: zero limit."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.findings import Finding, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Robot


def zero_limit(robot: Robot) -> Iterator[Finding]:
    """A joint's greatest velocity or effort is 0.

    With velocity 0 it never moves: MoveIt refuses to time a path, and simulators hold the joint. With effort 0 a motor
    has no force. Give the motor's figures, or leave the key out: then nothing is said about them. Joints that follow
    another one, and wheels that turn freely, may well have no effort.
    """
    for edge in robot.edges:
        joint = edge.joint
        if joint is None or joint.limit is None:
            continue
        driven = joint.type != "continuous" and joint.mimic is None
        values = {"velocity": joint.limit.velocity, "effort": joint.limit.effort if driven else None}
        for name, value in values.items():
            if value is not None and value <= 0:
                message = f"{joint.name}: the greatest {name} is {value:g}"
                advice = f"give the motor's {name}, or leave it out"
                yield finding("TF706", message, joint.at, help=advice)
