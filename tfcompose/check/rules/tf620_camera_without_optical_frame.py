"""TF620: camera without optical frame."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.check.geometry import CAMERAS
from tfcompose.findings import Finding, finding
from tfcompose.model import is_optical

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Robot


def camera_without_optical_frame(robot: Robot) -> Iterator[Finding]:
    """A camera has no optical frame.

    By REP-103 images are stamped with a frame whose z points forward and y down, named ``…_optical_frame``. Without it
    a driver stamps them with the body frame, and everything that projects pixels is turned by 90 degrees twice. Give
    the sensor one: ``frames: {NAME_optical_frame: {parent: NAME_link, rpy: [-90 deg, 0, -90 deg]}}``, or keep the
    preset's name for it.
    """
    children = robot.children()
    for sensor in robot.sensors:
        if sensor.kind not in CAMERAS:
            continue
        seen: set[str] = set()
        waiting = [sensor.mount]
        while waiting:
            frame = waiting.pop()
            if frame not in seen:
                seen.add(frame)
                waiting += [edge.child for edge in children.get(frame, ())]
        by_other_names = any(edge.other_axes for edge in robot.edges if edge.child in seen)
        if not by_other_names and not any(is_optical(frame) for frame in seen):
            message = f"the camera {sensor.name} has no optical frame"
            advice = f"a frame {sensor.name}_optical_frame with rpy: [-90 deg, 0, -90 deg]"
            yield finding("TF620", message, sensor.at, help=advice)
