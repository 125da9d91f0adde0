"""TF335: clocks mixed."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.findings import Finding, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Robot

_TRUE = frozenset({"true", "yes", "on", "y"})


def clocks_mixed(robot: Robot) -> Iterator[Finding]:
    """A node is told another clock than the robot has.

    Transforms are found by their stamps. Where one node stamps with the wall clock and another with /clock, every
    look-up fails, or finds what is decades old. Say it once for all, ros: {clock: sim}, and tfcompose tells each node.
    """
    sim = robot.ros.clock == "sim"
    for process in robot.processes:
        for node in process.nodes:
            said = node.params.get("use_sim_time")
            if said is None or (str(said).lower() in _TRUE) == sim:
                continue
            message = f"{node.name} has use_sim_time: {str(said).lower()}, and the robot's clock is {robot.ros.clock}"
            yield finding("TF335", message, node.at, help=f"remove it, or ros: {{clock: {'wall' if sim else 'sim'}}}")
