"""Rays in bundles with bounding cones, so that each body is tested against few rays."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING

from tfcompose.foundation.geometry import rotate

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from tfcompose.foundation.geometry import Quaternion, Vector

#: A bundle with more rays is split in two.
_FEW = 8
_ROUNDING_M = 1e-9
_NO_CONE = ((0.0, 0.0, 0.0), 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Bundle:
    """Rays from the origin, and a cone around the rays.

    Rays that spread over half a turn or more have no cone. Axis, cosine and sine are then 0.
    """

    #: The cone's axis, a unit vector.
    axis: Vector
    #: Cosine of half the cone's opening angle.
    cosine: float
    #: Sine of half the cone's opening angle.
    sine: float
    #: Numbers and directions of the rays; empty if ``parts`` holds the rays.
    rays: tuple[tuple[int, Vector], ...] = ()
    parts: tuple[Bundle, ...] = ()

    def rotate(self, quat_xyzw: Quaternion) -> Bundle:
        """Return the cone in another frame.

        ``quat_xyzw`` is the rays' orientation in that frame.
        """
        return replace(self, axis=rotate(quat_xyzw, self.axis), rays=(), parts=())

    def may_meet(self, x: float, y: float, z: float, radius: float) -> bool:
        """Return whether the cone meets the sphere around the point; all values in metres."""
        ax, ay, az = self.axis
        along = ax * x + ay * y + az * z
        across = math.sqrt(max(0.0, x * x + y * y + z * z - along * along))
        return across * self.cosine - along * self.sine <= radius + _ROUNDING_M

    def rays_near(
        self, x: float, y: float, z: float, radius: float
    ) -> Iterator[tuple[int, Vector]]:
        """Yield the rays of the smallest bundles whose cones meet the sphere around the point."""
        waiting = [self]
        while waiting:
            node = waiting.pop()
            if node.may_meet(x, y, z, radius):
                yield from node.rays
                waiting += node.parts


@lru_cache(maxsize=32)
def bundle_of(into: tuple[Vector, ...]) -> Bundle:
    """Return the bundle of rays in the directions ``into``, which are unit vectors."""
    return _bundle(list(enumerate(into)))


def _bundle(rays: list[tuple[int, Vector]]) -> Bundle:
    axis, cosine, sine = _cone([ray for _, ray in rays])
    if len(rays) <= _FEW:
        return Bundle(axis, cosine, sine, tuple(rays))
    extents = [max(values) - min(values) for values in zip(*(ray for _, ray in rays), strict=True)]
    widest, half = extents.index(max(extents)), len(rays) // 2
    ordered = sorted(rays, key=lambda ray: ray[1][widest])
    return Bundle(axis, cosine, sine, (), (_bundle(ordered[:half]), _bundle(ordered[half:])))


def _cone(into: Sequence[Vector]) -> tuple[Vector, float, float]:
    x, y, z = (sum(values) for values in zip(*into, strict=True)) if into else (0.0, 0.0, 0.0)
    length = math.hypot(x, y, z)
    if not length:
        return _NO_CONE
    axis = (x / length, y / length, z / length)
    cosine = min(sum(a * b for a, b in zip(axis, ray, strict=True)) for ray in into)
    if cosine <= 0:
        return _NO_CONE
    return axis, min(1.0, cosine), math.sqrt(max(0.0, 1 - cosine * cosine))
