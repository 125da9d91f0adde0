"""Rays from a stream's frame to the bodies around it."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from tfcompose.compiler.rays.bundle import bundle_of
from tfcompose.compiler.rays.directions import directions
from tfcompose.compiler.rays.shapes import depth_in, distance
from tfcompose.foundation.geometry import rotate

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from tfcompose.compiler.rays.bodies import PosedShape, Surroundings
    from tfcompose.compiler.rays.bundle import Bundle
    from tfcompose.foundation.geometry import Pose, Vector
    from tfcompose.model.robot import MountedSensor, Optics

#: Maximum distance of a body from a sensor, in metres.
_FAR_M = 1e3


@dataclass(frozen=True, slots=True)
class Ray:
    """A ray in the stream's frame: unit vector, distance to the first body, and the body's link.

    The distance is in metres, and infinite if no body blocks the ray.
    """

    direction: Vector
    distance: float = math.inf
    link: str | None = None


@dataclass(frozen=True, slots=True)
class View:
    """The hits of one stream's rays, which start at the origin of the stream's frame."""

    sensor: str
    optics: Optics
    #: Unit vectors in the stream's frame.
    directions: tuple[Vector, ...]
    #: Distance to the first body in metres, and the link of the body, by the ray's number.
    hits: Mapping[int, tuple[float, str]]
    #: Links whose bodies contain the origin, with the depth in metres. These bodies block no ray,
    #: because a flush-mounted sensor looks away from its mount.
    inside: Mapping[str, float]
    #: Links with an unreadable mesh: trimesh is not installed, or the file is not a mesh.
    left_out: tuple[str, ...] = ()

    @property
    def rays(self) -> tuple[Ray, ...]:
        """All rays, in the order of ``directions``."""
        return tuple(
            Ray(direction, *self.hits.get(index, (math.inf, None)))
            for index, direction in enumerate(self.directions)
        )

    @property
    def blocked(self) -> float:
        """Fraction of the rays that a body blocks, from 0 to 1."""
        return len(self.hits) / len(self.directions) if self.directions else 0.0

    @property
    def blocking(self) -> tuple[str, ...]:
        """Links that block rays, in descending order of blocked rays."""
        counts = Counter(link for _, link in self.hits.values())
        return tuple(sorted(counts, key=lambda link: (-counts[link], link)))


def view_of(around: Surroundings, sensor: MountedSensor, optics: Optics) -> View:
    """Return the view of a sensor's stream against the bodies that are fixed to the sensor.

    If the field of view is unknown, the view has no rays, only the links around its origin.
    """
    into = directions(optics)
    reach = reach_of(optics) if into else 0.0
    bodies = around.bodies(sensor, optics.frame, into, reach)
    return cast(sensor.name, optics, into, bodies)


def reach_of(optics: Optics) -> float:
    """Return the distance in metres up to which bodies can block the stream."""
    return min(optics.far or _FAR_M, _FAR_M)


def cast(
    sensor: str, optics: Optics, into: tuple[Vector, ...], bodies: Iterable[PosedShape]
) -> View:
    """Return the hits of rays in the directions ``into``, unit vectors in the bodies' frame."""
    reach, bundle = reach_of(optics), bundle_of(into)
    nearest: dict[int, tuple[float, int, str]] = {}
    inside: dict[str, float] = {}
    left_out: dict[str, None] = {}
    by_distance = sorted(
        (math.hypot(*body.pose.xyz) - body.shape.radius, order, body)
        for order, body in enumerate(bodies)
    )
    for begins, order, body in by_distance:
        if begins > reach:
            continue
        depth, hits = _read_hits(body, into, bundle, begins, nearest)
        if depth is None:
            left_out[body.link] = None
        elif depth >= 0:
            inside[body.link] = max(depth, inside.get(body.link, 0.0))
        for index, far in hits:
            if far <= reach and (index not in nearest or (far, order) < nearest[index][:2]):
                nearest[index] = (far, order, body.link)
    blocked = {
        index: (far, link) for index, (far, _, link) in nearest.items() if link not in inside
    }
    return View(sensor, optics, into, hits=blocked, inside=inside, left_out=tuple(left_out))


Hits = list[tuple[int, float]]
#: By the number of a ray: distance to its nearest hit, order of the hit body, and the body's link.
Nearest = Mapping[int, tuple[float, int, str]]


def _read_hits(
    body: PosedShape, into: Sequence[Vector], bundle: Bundle, begins: float, nearest: Nearest
) -> tuple[float | None, Hits]:
    """Return the depth of the origin in the body, and the rays that hit the body.

    The depth is None if the body's mesh cannot be read. Rays that hit another body at a distance
    below ``begins`` may be left out.
    """
    to_shape = body.pose.inverse()
    if body.shape.kind != "mesh":
        depth = depth_in(body.shape, to_shape.xyz)
        return depth, [] if depth >= 0 else _hits(body, to_shape, bundle, begins, nearest)
    path = body.shape.mesh.path if body.shape.mesh else ""
    x, y, z = body.shape.size
    turned = [rotate(to_shape.quat_xyzw, direction) for direction in into]
    try:
        # Importing numpy and trimesh takes 0.3 s, and most robots do not need them.
        from tfcompose.compiler.rays import meshes  # noqa: PLC0415

        depth = meshes.depth_in(path, (x, y, z), to_shape.xyz)
        far = meshes.distances(path, (x, y, z), to_shape.xyz, turned) if depth < 0 else []
    except Exception:  # noqa: BLE001 (readers of a dozen formats: anything can come out of them)
        return None, []
    return depth, [
        (index, distance) for index, distance in enumerate(far) if math.isfinite(distance)
    ]


def _hits(
    body: PosedShape, to_shape: Pose, bundle: Bundle, begins: float, nearest: Nearest
) -> Hits:
    """Return the rays that hit a primitive shape, with the distances of the hits."""
    (x, y, z), radius = body.pose.xyz, body.shape.radius
    miss = x * x + y * y + z * z - radius * radius
    hits = []
    for index, direction in bundle.rays_near(x, y, z, radius):
        along = direction[0] * x + direction[1] * y + direction[2] * z
        if miss > 0 and (along <= 0 or along * along < miss):
            continue  # the ray misses the shape's bounding sphere
        if index in nearest and nearest[index][0] < begins:
            continue
        far = distance(body.shape, to_shape.xyz, rotate(to_shape.quat_xyzw, direction))
        if math.isfinite(far):
            hits.append((index, far))
    return hits
