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

    What is not known is None; lengths in metres, angles in radians.

    A ``camera`` looks along z of ``frame``, x right and y down (REP-103), one that is ``backward``
    along -z with y up; every other kind looks along x, y left and z up. ``horizontal`` and
    ``vertical`` are [from, to], counted from where the stream looks, to the left and up positive:
    a lidar's are angles of the LaserScan and elevations of beams. ``diagonal`` is a whole angle,
    from corner to corner, or of a fisheye's image circle. ``resolution`` is (width, height) in
    pixels. ``near`` and ``far`` are of z for a camera that measures depth, so that its far face is
    flat; of the distance along the ray for every other kind. ``elevations`` holds those of a
    lidar's channels, ``samples`` how many there are in one scan or one turn, ``baseline`` the
    distance of the two imagers that depth is computed from. A stream that is ``active`` sends the
    light or the sound that it receives.
    """

    stream: str
    frame: str
    kind: OpticsKind
    span: Span
    projection: Projection = "pinhole"
    backward: bool = False
    horizontal: Sector | None = None
    vertical: Sector | None = None
    diagonal: float | None = None
    resolution: tuple[int, int] | None = None
    near: float | None = None
    far: float | None = None
    channels: int | None = None
    elevations: tuple[float, ...] = ()
    samples: int | None = None
    rate: float | None = None
    shutter: Shutter | None = None
    baseline: float | None = None
    active: bool = False
    sources: tuple[OpticsSource, ...] = ()
