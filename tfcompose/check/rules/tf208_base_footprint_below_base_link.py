"""TF208: base footprint below base link."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.findings import Finding, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Robot


def base_footprint_below_base_link(robot: Robot) -> Iterator[Finding]:
    """The frame base_footprint hangs on base_link, and should be above it.

    base_footprint is the robot's place on the ground, which stays level while the robot pitches and rolls. Fixed below
    base_link it tilts along, and an odometry that is set to base_footprint would give it a second parent. Write
    ``base_link: {parent: base_footprint, xyz: [0, 0, 0.1]}``, and let odometry move base_footprint. On a robot that
    never tilts nothing is wrong but the name: then allow it.
    """
    for edge in robot.edges:
        prefix, _, name = edge.child.rpartition("/")
        above, _, parent = edge.parent.rpartition("/")
        if (name, parent) == ("base_footprint", "base_link") and prefix == above:
            message = f"{edge.child} hangs on {edge.parent}, and tilts with it"
            advice = f"turn it round: {edge.parent}: {{parent: {edge.child}}}, with the inverse pose"
            yield finding("TF208", message, edge.at, help=advice)
