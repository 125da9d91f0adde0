"""TF623: serial missing."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from tfcompose.findings import Finding, Note, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import MountedSensor, Process, Robot


#: Parts of parameter names that tell two devices apart as well as a serial number.
APART = ("serial", "usb_port", "device_type", "device_id", "mxid", "guid", "mac", "ip")


def serial_missing(robot: Robot) -> Iterator[Finding]:
    """Two sensors have the same driver, and one of them does not say which device is its.

    Each driver takes the first device that it finds, so after the next start left and right may be exchanged, or both
    drivers fight for one. Give each its serial number: ``options: {serial: "123456789012"}``. Another parameter that
    names the device (``usb_port_id``, ``device_type``) counts too. Drivers that somebody else starts are left alone.
    """
    processes = {process.name: process for process in robot.processes if process.kind == "run" and process.package}
    groups: dict[tuple[str | None, str | None, str | None], list[MountedSensor]] = {}
    for sensor in robot.sensors:
        process = processes.get(sensor.driver)
        if process and sensor.driver == sensor.name and sensor.serial_option:
            groups.setdefault((process.package, process.executable, sensor.serial_option), []).append(sensor)
    for group in groups.values():
        for sensor in group if len(group) > 1 else ():
            if not (sensor.serial or robot.excuses(sensor.name) or _told(processes[sensor.driver])):
                other = next(one for one in group if one is not sensor)
                message = f"{sensor.name} and {other.name} have one driver, and {sensor.name} has no serial number"
                notes = [Note(f"{other.name} stands here", other.at)]
                advice = f'options: {{{sensor.serial_option}: "…"}}'
                yield finding("TF623", message, sensor.at, help=advice, notes=notes)


def _told(process: Process) -> bool:
    """Whether a parameter names the device."""
    return any(
        word in re.split(r"[_.]", key) or (len(word) > SHORT and word in key)
        for key in process.params
        for word in APART
    )


SHORT = 3
