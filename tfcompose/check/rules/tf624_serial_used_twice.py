"""TF624: serial used twice."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.findings import Finding, Note, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import MountedSensor, Robot


def serial_used_twice(robot: Robot) -> Iterator[Finding]:
    """Two sensors have one serial number.

    There is one such device, and the second driver does not get it. Read the number off the device or from the vendor's
    tool (``rs-enumerate-devices -s``).
    """
    first: dict[tuple[str, str], MountedSensor] = {}
    for sensor in robot.sensors:
        if sensor.serial:
            other = first.setdefault((sensor.preset.partition("/")[0], str(sensor.serial)), sensor)
            if other is not sensor:
                message = f"{sensor.name} and {other.name} have the serial number {sensor.serial}"
                notes = [Note(f"{other.name} stands here", other.at)]
                yield finding("TF624", message, sensor.at, help="one of the two is another device", notes=notes)
