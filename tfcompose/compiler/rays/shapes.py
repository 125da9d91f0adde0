"""Intersections of rays with primitive shapes, in the frames of the shapes.

As in URDF, a shape is centred on the origin, and a cylinder lies along z.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tfcompose.foundation.geometry import Vector
    from tfcompose.model.robot import Shape

_TINY = 1e-12


def depth_in(shape: Shape, point: Vector) -> float:
    """Return the depth of the point in the shape, in metres; negative outside.

    The point is in the shape's frame. Meshes are not supported.
    """
    x, y, z = point
    size = shape.size
    match shape.kind:
        case "sphere":
            return size[0] - math.hypot(x, y, z)
        case "cylinder":
            return min(size[0] - math.hypot(x, y), size[1] / 2 - abs(z))
        case "capsule":
            return size[0] - math.hypot(x, y, max(0.0, abs(z) - size[1] / 2))
    return min(extent / 2 - abs(value) for extent, value in zip(size, point, strict=True))


def distance(shape: Shape, origin: Vector, direction: Vector) -> float:
    """Return the distance in metres along the ray to the shape; infinite without a hit.

    ``origin`` is outside the shape. Meshes are not supported.
    """
    size = shape.size
    match shape.kind:
        case "sphere":
            return _sphere(size[0], origin, direction)
        case "cylinder":
            return min(
                _tube(size[0], size[1], origin, direction),
                _caps(size[0], size[1], origin, direction),
            )
        case "capsule":
            ends = (
                (origin[0], origin[1], origin[2] + half) for half in (size[1] / 2, -size[1] / 2)
            )
            return min(
                _tube(size[0], size[1], origin, direction),
                *(_sphere(size[0], end, direction) for end in ends),
            )
    return _box(size, origin, direction)


def _sphere(radius: float, origin: Vector, direction: Vector) -> float:
    along = -sum(a * b for a, b in zip(origin, direction, strict=True))
    square = radius**2 - sum(value**2 for value in origin) + along**2
    if square < 0 or along < 0:
        return math.inf
    return max(0.0, along - math.sqrt(square))


def _tube(radius: float, length: float, origin: Vector, direction: Vector) -> float:
    """Return the distance at which the ray enters the side of a cylinder from outside."""
    a = direction[0] ** 2 + direction[1] ** 2
    if a < _TINY:
        return math.inf
    along = -(origin[0] * direction[0] + origin[1] * direction[1]) / a
    square = along**2 - (origin[0] ** 2 + origin[1] ** 2 - radius**2) / a
    if square < 0:
        return math.inf
    far = along - math.sqrt(square)
    return far if far >= 0 and abs(origin[2] + far * direction[2]) <= length / 2 else math.inf


def _caps(radius: float, length: float, origin: Vector, direction: Vector) -> float:
    if abs(direction[2]) < _TINY:
        return math.inf
    best = math.inf
    for end in (-length / 2, length / 2):
        far = (end - origin[2]) / direction[2]
        if (
            far >= 0
            and math.hypot(origin[0] + far * direction[0], origin[1] + far * direction[1])
            <= radius
        ):
            best = min(best, far)
    return best


def _box(size: tuple[float, ...], origin: Vector, direction: Vector) -> float:
    """Return the distance at which the ray enters the box from outside.

    The function uses the slab method of Kay and Kajiya.
    """
    enters, leaves = 0.0, math.inf
    for extent, start, step in zip(size, origin, direction, strict=True):
        if abs(step) < _TINY:
            if abs(start) > extent / 2:
                return math.inf
            continue
        half = extent / 2 if step > 0 else -extent / 2
        first, last = (-half - start) / step, (half - start) / step
        enters = max(enters, first)
        leaves = min(leaves, last)
        if enters > leaves:
            return math.inf
    return enters
