"""A sensor as the rules see it, and how frames are named whose z axis looks."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

#: How names of optical frames end: REP-103's suffix, the spelling of newer ZED wrappers, and a short one.
OPTICAL_ENDINGS = ("_optical_frame", "_frame_optical", "_optical")

if TYPE_CHECKING:
    from tfcompose.findings import Span


def is_optical(frame: str) -> bool:
    """Return whether the frame's name says that z is its viewing direction."""
    return frame.endswith(OPTICAL_ENDINGS)


@dataclass(frozen=True, slots=True)
class MountedSensor:
    """A sensor as the rules see it: the frames that it brings, and its driver.

    ``driver`` is the name of the driver's process, empty without one; ``switch`` holds the parameters that keep the
    driver from publishing frames (None: there are none), ``publishes`` says that it may. ``claims`` are the edges
    outside the sensor that it publishes by default and does not own, each with the parameters that keep it from that.
    ``serial_option`` is the preset's option for a serial number, empty where it has none.
    """

    name: str
    preset: str
    kind: str
    at: Span
    mount: str
    frames: tuple[str, ...] = ()
    driver_frames: tuple[str, ...] = ()
    driver: str = ""
    switch: dict[str, Any] | None = None
    publishes: bool = False
    claims: dict[str, dict[str, Any]] = field(default_factory=dict)
    serial_option: str = ""
    serial: str | None = None
    tf_at: Span | None = None
