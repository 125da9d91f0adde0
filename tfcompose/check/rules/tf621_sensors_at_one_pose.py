"""TF621: sensors at one pose."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.check.geometry import are_mirrored
from tfcompose.findings import Finding, Note, finding
from tfcompose.geometry import Pose, angle_between

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Edge, Robot


#: What is built into other devices, and so may share their place.
BUILT_IN_KINDS = frozenset({"imu", "gnss"})
NEAR_M, NEAR_RAD = 1e-6, 1e-6


def sensors_at_one_pose(robot: Robot) -> Iterator[Finding]:
    """Two sensors are mounted at exactly one pose.

    Two bodies cannot be in one place: a mount was copied, and its numbers not changed. Measure the second one. An IMU
    or GNSS receiver may sit inside another sensor, and sensors without any pose yet are left alone; about calibrations
    that were copied is TF618.
    """
    kinds = {sensor.name: sensor.kind for sensor in robot.sensors}
    mounts = [edge for edge in robot.edges if edge.given and edge.sensor in kinds and edge.pose != Pose()]
    first: dict[tuple[object, ...], Edge] = {}
    for edge in mounts:
        if edge.calibration or kinds[edge.sensor or ""] in BUILT_IN_KINDS:
            continue
        place = (edge.parent, *(round(part / NEAR_M) for part in edge.pose.xyz))
        other = first.setdefault(place, edge)
        turned = angle_between(edge.pose.quat_xyzw, other.pose.quat_xyzw)
        if other is not edge and turned < NEAR_RAD and not are_mirrored(other, edge):
            message = f"{edge.sensor} and {other.sensor} are at one pose on {edge.parent}"
            notes = [Note(f"{other.sensor} is mounted here", other.at)]
            yield finding("TF621", message, edge.at, help="measure one of them again", notes=notes)
