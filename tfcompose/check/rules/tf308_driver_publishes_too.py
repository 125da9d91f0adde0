"""TF308: driver publishes too."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.diagnostic import Diagnostic, Note, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Robot


def driver_publishes_too(robot: Robot) -> Iterator[Diagnostic]:
    """A sensor's driver publishes frames by default that tfcompose owns, and tfcompose cannot switch it off.

    With ``tf: tfcompose`` the frames inside a sensor are published by tfcompose, and a driver that tfcompose starts is
    told to keep quiet. One that somebody else starts, or that is started by a command of its own, is not told: both
    would publish, and tf2 takes the last writer. Set the driver's switch where it is started, and allow this finding
    there; or leave the frames to it with ``tf: driver``.
    """
    processes = {process.name: process for process in robot.processes}
    for sensor in robot.sensors:
        process = processes.get(sensor.driver)
        if sensor.publishes or not sensor.driver_frames or process is None or not sensor.switch:
            continue
        words = " ".join(process.argv).lower()
        told = process.kind == "run" and all(
            (process.package and process.params.get(key) == value) or f"{key}:={value}".lower() in words
            for key, value in sensor.switch.items()
        )
        if process.kind in {"run", "external"} and not told:
            count, first = len(sensor.driver_frames), sensor.driver_frames[0]
            what = f"{first} and {count - 1} more" if count > 1 else first
            message = f"{process.name} publishes {what} by default, which tfcompose owns (tf: tfcompose)"
            switch = ", ".join(f"{key}: {str(value).lower()}" for key, value in sensor.switch.items())
            advice = f"start {process.name} with the parameter {switch}; or leave the frames to it: tf: driver"
            notes = [Note(f"{process.name} is declared here", process.at)] if process.at != sensor.at else []
            yield finding("TF308", message, sensor.tf_at or sensor.at, help=advice, notes=notes)
