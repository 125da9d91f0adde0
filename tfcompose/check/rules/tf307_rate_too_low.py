"""TF307: rate too low."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.findings import Finding, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Robot


#: Least rates in Hz of the edges that navigation looks up for every scan and every control step.
LEAST = {
    ("odom", "base_link"): 20.0,
    ("odom", "base_footprint"): 20.0,
    ("map", "odom"): 5.0,
}


def rate_too_low(robot: Robot) -> Iterator[Finding]:
    """Odometry comes with less than 20 Hz, or map → odom with less than 5 Hz.

    Between two messages tf2 interpolates, and after the last one it refuses: scans are dropped with "extrapolation into
    the future", and controllers act on an old pose. Raise the rate of the node that publishes the edge
    (``publish_rate``, ``frequency``, ``transform_publish_period``) and then the one declared here. Stand-ins are left
    alone.
    """
    simulated = {process.name for process in robot.processes if process.kind == "simulate"}
    for edge in robot.edges:
        ends = (edge.parent.rpartition("/")[2], edge.child.rpartition("/")[2])
        least = LEAST.get(ends)
        if least and edge.rate is not None and edge.rate < least and edge.kind != "static":
            if edge.owner in simulated:
                continue
            message = f"{edge.name} comes with {edge.rate:g} Hz, and should with {least:g} Hz or more"
            advice = f"raise the rate of {edge.owner}, and then the one that is declared here"
            yield finding("TF307", message, edge.rate_at or edge.at, help=advice)
