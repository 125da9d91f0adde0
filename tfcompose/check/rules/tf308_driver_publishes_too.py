"""TF308: driver publishes too."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tfcompose.findings import Finding, Note, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import MountedSensor, Process, Robot


def driver_publishes_too(robot: Robot) -> Iterator[Finding]:
    """A sensor's driver publishes frames by default that tfcompose owns, and tfcompose cannot switch it off.

    With ``tf: tfcompose`` the frames inside a sensor are published by tfcompose, and a driver that tfcompose starts is
    told to keep quiet. One that somebody else starts, or that is started by a command of its own, is not told: both
    would publish, and tf2 takes the last writer. Set the driver's switch where it is started, and allow this finding
    there; or leave the frames to it with ``tf: driver``. The same holds for edges outside the sensor that a driver
    sends by default, such as map → laser by sick_scan_xd.
    """
    processes = {process.name: process for process in robot.processes}
    for sensor in robot.sensors:
        process = processes.get(sensor.driver)
        if process is None:
            continue
        if sensor.driver_frames and not sensor.publishes and sensor.switch and not _told(process, sensor.switch):
            count, first = len(sensor.driver_frames), sensor.driver_frames[0]
            what = f"{first} and {count - 1} more" if count > 1 else first
            message = f"{process.name} publishes {what} by default, which tfcompose owns (tf: tfcompose)"
            yield _finding(sensor, process, message, sensor.switch, "; or leave the frames to it: tf: driver")
        for edge, off in sensor.claims.items():
            if not _told(process, off):
                message = f"{process.name} publishes {edge} by default, and does not own it"
                yield _finding(sensor, process, message, off, "")


def _told(process: Process, switch: dict[str, Any]) -> bool:
    """Whether the plan tells the process, or starts nothing that could publish."""
    words = " ".join(process.argv).lower()
    return process.kind not in {"run", "external"} or (
        process.kind == "run"
        and all(
            (process.package and process.params.get(key) == value) or f"{key}:={value}".lower() in words
            for key, value in switch.items()
        )
    )


def _finding(sensor: MountedSensor, process: Process, message: str, off: dict[str, Any], instead: str) -> Finding:
    switch = ", ".join(f"{key}: {str(value).lower()}" for key, value in off.items())
    advice = f"start {process.name} with the parameter {switch}{instead}"
    notes = [Note(f"{process.name} is declared here", process.at)] if process.at != sensor.at else []
    return finding("TF308", message, sensor.tf_at or sensor.at, help=advice, notes=notes, severity="warning")
