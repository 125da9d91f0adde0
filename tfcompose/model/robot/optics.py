"""Optics of a sensor: field of view, resolution and range of each stream."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from tfcompose.foundation.findings import Span

OpticsKind = Literal["camera", "lidar", "radar", "ultrasonic"]
Projection = Literal["pinhole", "fisheye"]
Shutter = Literal["global", "rolling"]
Sector = tuple[float, float]


@dataclass(frozen=True, slots=True)
class OpticsSource:
    """Where the values of some keys are from, and of what kind that is."""

    keys: tuple[str, ...]
    where: str
    quality: str


@dataclass(frozen=True, slots=True)
class Optics:
    """One stream of a sensor, in its frame.

    Unknown values are None. Lengths are in metres, angles in radians. A camera looks along z of
    the frame, x right and y down (REP-103). Every other kind looks along x, y left and z up.
    """

    stream: str
    frame: str
    kind: OpticsKind
    span: Span
    projection: Projection = "pinhole"
    #: A camera that looks along -z, with y up.
    backward: bool = False
    #: [from, to], counted from the viewing direction, left positive; a lidar's are angles of the
    #: LaserScan.
    horizontal: Sector | None = None
    #: [from, to], counted from the viewing direction, up positive; a lidar's are elevations of
    #: beams.
    vertical: Sector | None = None
    #: The full angle from corner to corner, or of a fisheye's image circle.
    diagonal: float | None = None
    #: Width and height in pixels.
    resolution: tuple[int, int] | None = None
    #: For a camera that measures depth a value of z, so that its faces are flat; for every other
    #: kind a distance along the ray.
    near: float | None = None
    #: As ``near``.
    far: float | None = None
    channels: int | None = None
    #: Elevations of a lidar's channels.
    elevations: tuple[float, ...] = ()
    #: The number in one scan or one turn.
    samples: int | None = None
    rate: float | None = None
    shutter: Shutter | None = None
    #: The distance of the two imagers from which depth is computed.
    baseline: float | None = None
    #: Whether the stream emits the light or sound that it receives.
    active: bool = False
    sources: tuple[OpticsSource, ...] = ()
