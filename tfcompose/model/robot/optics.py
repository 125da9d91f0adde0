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
    """The source of the values of some keys, and the kind of source."""

    keys: tuple[str, ...]
    where: str
    quality: str


@dataclass(frozen=True, slots=True)
class Optics:
    """A stream of a sensor, in the stream's frame.

    Unknown values are None. Lengths are in metres, angles in radians. A camera looks along z of
    its frame, with x right and y down (REP-103). Every other kind looks along x, with y left and z
    up.
    """

    stream: str
    frame: str
    kind: OpticsKind
    span: Span
    projection: Projection = "pinhole"
    #: Whether the camera looks along -z, with y up.
    backward: bool = False
    #: [from, to] from the viewing direction, positive to the left. For a lidar, these are the
    #: angles of LaserScan.
    horizontal: Sector | None = None
    #: [from, to] from the viewing direction, positive upwards. For a lidar, these are elevations
    #: of beams.
    vertical: Sector | None = None
    #: The full angle from corner to corner, or of the image circle of a fisheye camera.
    diagonal: float | None = None
    #: Width and height in pixels.
    resolution: tuple[int, int] | None = None
    #: Smallest distance: for a depth camera along z, for every other kind along the ray.
    near: float | None = None
    #: Largest distance, measured like ``near``.
    far: float | None = None
    channels: int | None = None
    #: Elevations of a lidar's channels.
    elevations: tuple[float, ...] = ()
    #: Number of samples in a scan or a revolution.
    samples: int | None = None
    rate: float | None = None
    shutter: Shutter | None = None
    #: Distance of the two imagers of a stereo camera.
    baseline: float | None = None
    #: Whether the sensor emits the light or sound that it receives.
    active: bool = False
    sources: tuple[OpticsSource, ...] = ()
