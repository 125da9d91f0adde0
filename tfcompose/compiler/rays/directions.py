"""Viewing directions of a stream, and a test whether its field of view contains a point."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING

from tfcompose.foundation.findings import Span

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.foundation.geometry import Vector
    from tfcompose.model.robot import MountedSensor, Optics

#: Maximum number of rays of a stream: columns and rows of an image; steps of a turn and rows of a
#: lidar.
_IMAGE = (24, 16)
_CIRCLE, _ROWS = 360, 9
_COARSE_CIRCLE = 90
_DISC = 300
_GOLDEN_ANGLE = math.pi * (3 - math.sqrt(5))
#: Angle in radians up to which a ray counts as in a scanner's plane.
_FLAT_RAD = 1e-6


def different_streams(sensor: MountedSensor) -> Iterator[Optics]:
    """Yield the sensor's streams, without repeated combinations of frame and view."""
    visited = set()
    for stream in sensor.optics:
        sight = (
            stream.frame,
            stream.kind,
            stream.projection,
            stream.backward,
            stream.horizontal,
            stream.vertical,
            stream.diagonal,
        )
        if sight not in visited:
            visited.add(sight)
            yield stream


def is_plane(optics: Optics) -> bool:
    """Return whether the stream is known to scan one plane."""
    return optics.vertical is not None and optics.vertical[1] - optics.vertical[0] < _FLAT_RAD


def directions(optics: Optics) -> tuple[Vector, ...]:
    """Return unit vectors in the stream's frame, evenly spread over its image or sector.

    Empty if the field of view is unknown. A scanner's plane is sampled every degree, in order from
    its first angle to its last.
    """
    return _directions(replace(optics, stream="", frame="", span=_NOWHERE, sources=()))


_NOWHERE = Span("")


@lru_cache(maxsize=32)
def _directions(optics: Optics) -> tuple[Vector, ...]:
    if optics.projection == "fisheye":
        return _disc(optics)
    if optics.horizontal is None or optics.vertical is None:
        return ()
    if optics.kind == "camera":
        return _image(optics, optics.horizontal, optics.vertical)
    if optics.kind == "lidar":
        return _scan(optics, optics.horizontal, optics.vertical)
    return _cone(optics.horizontal, optics.vertical)


def contains(optics: Optics, point: Vector) -> bool:
    """Return whether the point, in the stream's frame, is in the stream's image or sector."""
    if optics.kind == "camera":
        x, y, z = point
        forward, left, up = (-z, -x, y) if optics.backward else (z, -x, -y)
        if optics.projection == "fisheye":
            return (
                optics.diagonal is not None
                and math.atan2(math.hypot(left, up), forward) <= optics.diagonal / 2
            )
        if optics.horizontal is None or optics.vertical is None or forward <= 0:
            return False
        return _is_in(math.atan2(left, forward), optics.horizontal) and _is_in(
            math.atan2(up, forward), optics.vertical
        )
    if optics.horizontal is None or optics.vertical is None:
        return False
    x, y, z = point
    azimuth, elevation = math.atan2(y, x), math.atan2(z, math.hypot(x, y))
    return _is_on_circle(azimuth, optics.horizontal) and _is_in(elevation, optics.vertical)


def _is_in(angle: float, sector: tuple[float, float]) -> bool:
    return sector[0] - _FLAT_RAD <= angle <= sector[1] + _FLAT_RAD


def _is_on_circle(angle: float, sector: tuple[float, float]) -> bool:
    """Return whether the angle is in the sector, which may cross ±180 degrees."""
    return (angle - sector[0] + _FLAT_RAD) % math.tau <= sector[1] - sector[0] + 2 * _FLAT_RAD


def _middles(sector: tuple[float, float], count: int) -> list[float]:
    """Return the middles of ``count`` equal parts of the sector."""
    step = (sector[1] - sector[0]) / count
    return [sector[0] + (index + 0.5) * step for index in range(count)]


def _unit(x: float, y: float, z: float) -> Vector:
    length = math.hypot(x, y, z)
    return (x / length, y / length, z / length)


def _in_camera(optics: Optics, left: float, up: float, forward: float) -> Vector:
    return _unit(-left, up, -forward) if optics.backward else _unit(-left, -up, forward)


def _image(
    optics: Optics, horizontal: tuple[float, float], vertical: tuple[float, float]
) -> tuple[Vector, ...]:
    """Return the directions of pixels that are evenly spread over the image."""
    if max(map(abs, (*horizontal, *vertical))) >= math.pi / 2:
        return ()  # an image plane cannot be that wide
    columns = _middles((math.tan(horizontal[0]), math.tan(horizontal[1])), _IMAGE[0])
    rows = _middles((math.tan(vertical[0]), math.tan(vertical[1])), _IMAGE[1])
    return tuple(
        _in_camera(optics, left, up, 1.0) for up in reversed(rows) for left in reversed(columns)
    )


def _disc(optics: Optics) -> tuple[Vector, ...]:
    """Return pixel directions spread evenly over an equidistant fisheye image (Vogel's spiral)."""
    if optics.diagonal is None:
        return ()
    made = []
    for index in range(_DISC):
        angle = optics.diagonal / 2 * math.sqrt((index + 0.5) / _DISC)
        around = index * _GOLDEN_ANGLE
        left, up = math.sin(angle) * math.cos(around), math.sin(angle) * math.sin(around)
        made.append(_in_camera(optics, left, up, math.cos(angle)))
    return tuple(made)


def _scan(
    optics: Optics, horizontal: tuple[float, float], vertical: tuple[float, float]
) -> tuple[Vector, ...]:
    extent = horizontal[1] - horizontal[0]
    steps = _CIRCLE if is_plane(optics) else _COARSE_CIRCLE
    azimuths = _middles(horizontal, max(1, round(steps * extent / math.tau)))
    if is_plane(optics):
        elevations = [vertical[0]]
    elif len(optics.elevations) > 1:
        beams = sorted(optics.elevations)
        count = min(_ROWS, len(beams))
        elevations = [
            beams[round(index * (len(beams) - 1) / (count - 1))] for index in range(count)
        ]
    else:
        elevations = _middles(vertical, _ROWS)
    return tuple(
        (math.cos(up) * math.cos(left), math.cos(up) * math.sin(left), math.sin(up))
        for up in elevations
        for left in azimuths
    )


def _cone(horizontal: tuple[float, float], vertical: tuple[float, float]) -> tuple[Vector, ...]:
    """Return directions spread evenly over an elliptic cone about x."""
    made = []
    for index in range(_DISC):
        radius, around = math.sqrt((index + 0.5) / _DISC), index * _GOLDEN_ANGLE
        left = _angle_in(horizontal, radius * math.cos(around))
        up = _angle_in(vertical, radius * math.sin(around))
        made.append((math.cos(up) * math.cos(left), math.cos(up) * math.sin(left), math.sin(up)))
    return tuple(made)


def _angle_in(sector: tuple[float, float], part: float) -> float:
    """Return the angle at a relative position in the sector, from -1 to 1."""
    return (sector[0] + sector[1]) / 2 + part * (sector[1] - sector[0]) / 2
