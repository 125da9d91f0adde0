"""TF207: wrong chain order."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.findings import Finding, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Robot


#: From the world inwards, as REP-105 orders them. base_footprint and base_link are one level: TF208 is about the two.
LEVELS = {"earth": 0, "map": 1, "odom": 2, "base_footprint": 3, "base_link": 3}

#: No more edges are followed upwards than this.
FARTHEST = 100


def wrong_chain_order(robot: Robot) -> Iterator[Finding]:
    """The frames earth, map, odom and base_link hang on each other in another order than REP-105 gives.

    Localisation publishes map → odom and odometry odom → base_link; navigation, SLAM and recorded data expect it so. A
    node that adds its edge to a chain in another order gives a frame a second parent. A level may be left out. Turn the
    edge round: its pose is then the inverse. Example: ``odom: {parent: map}``, ``base_link: {parent: odom}``.
    """
    above = {edge.child: edge for edge in reversed(robot.edges)}
    for edge in robot.edges:
        prefix, level = _level(edge.child)
        seen, parent = {edge.child}, edge.parent
        while level is not None and parent not in seen and len(seen) < FARTHEST:
            seen.add(parent)
            other_prefix, other = _level(parent)
            if other is not None and other > level and other_prefix in {prefix, ""}:
                message = f"{edge.child} hangs below {parent}; by REP-105 it is the other way round"
                advice = "the order is earth → map → odom → base_link; the pose of a turned edge is the inverse"
                yield finding("TF207", message, edge.at, help=advice)
                break
            parent = above[parent].parent if parent in above else parent


def _level(frame: str) -> tuple[str, int | None]:
    prefix, _, name = frame.rpartition("/")
    return prefix, LEVELS.get(name)
