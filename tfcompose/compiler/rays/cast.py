"""Rays from a stream into the bodies around it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from tfcompose.compiler.rays.bodies import PosedShape, bodies_around, fixed_to
from tfcompose.compiler.rays.directions import directions
from tfcompose.compiler.rays.shapes import depth_in, distance
from tfcompose.foundation.geometry import rotate

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from tfcompose.foundation.geometry import Pose, Vector
    from tfcompose.model.robot import MountedSensor, Optics, Robot

#: Beyond this nothing of a robot is.
_FAR_M = 1e3


@dataclass(frozen=True, slots=True)
class Ray:
    """A ray in the stream's frame: a unit vector, and the metres to the first body, a link.

    Endless if it is free.
    """

    direction: Vector
    distance: float = math.inf
    link: str | None = None


@dataclass(frozen=True, slots=True)
class View:
    """The rays of one stream, from the origin of its frame.

    ``inside`` are the links that the origin is in or on, and how deep in metres; their bodies
    block no ray: a sensor that is mounted flush looks away from what it is mounted on.
    ``left_out`` are the links of which a mesh could not be read: trimesh is not installed, or the
    file is no mesh.
    """

    sensor: str
    optics: Optics
    rays: tuple[Ray, ...]
    inside: Mapping[str, float]
    left_out: tuple[str, ...] = ()

    @property
    def blocked(self) -> float:
        """The part of the rays that a body blocks, from 0 to 1."""
        return (
            sum(ray.link is not None for ray in self.rays) / len(self.rays) if self.rays else 0.0
        )

    @property
    def blocking(self) -> tuple[str, ...]:
        """The links that block rays, the one that blocks most first."""
        counts: dict[str, int] = {}
        for ray in self.rays:
            if ray.link is not None:
                counts[ray.link] = counts.get(ray.link, 0) + 1
        return tuple(sorted(counts, key=lambda link: (-counts[link], link)))


def view_of(
    robot: Robot, sensor: MountedSensor, optics: Optics, poses: Mapping[str, Pose] | None = None
) -> View:
    """Return the rays of one stream of the sensor; none if its field of view is not known.

    ``poses`` are those of frames in the stream's frame, of which bodies are taken into account;
    default: of all that are fixed to it.
    """
    bodies = list(
        bodies_around(robot, sensor, fixed_to(robot, optics.frame) if poses is None else poses)
    )
    return cast(sensor.name, optics, directions(optics), bodies)


def cast(
    sensor: str, optics: Optics, into: Sequence[Vector], bodies: Sequence[PosedShape]
) -> View:
    """Return the rays into these directions, unit vectors in the frame in which the bodies are."""
    found: list[tuple[float, str | None]] = [(math.inf, None)] * len(into)
    reach = min(optics.far or _FAR_M, _FAR_M)
    inside: dict[str, float] = {}
    left_out: dict[str, None] = {}
    for body in bodies:
        if math.dist(body.pose.xyz, (0, 0, 0)) - body.shape.radius > reach:
            continue
        depth, hits = _read_hits(body, into)
        if depth is None:
            left_out[body.link] = None
        elif depth >= 0:
            inside[body.link] = max(depth, inside.get(body.link, 0.0))
        for index, far in hits:
            if far < found[index][0] and far <= reach:
                found[index] = (far, body.link)
    rays = []
    for direction, (far, link) in zip(into, found, strict=True):
        is_free = link in inside
        rays.append(Ray(direction, math.inf, None) if is_free else Ray(direction, far, link))
    return View(sensor, optics, tuple(rays), inside, tuple(left_out))


Hits = list[tuple[int, float]]


def _read_hits(body: PosedShape, into: Sequence[Vector]) -> tuple[float | None, Hits]:
    """Return how deep the origin is in the body, and where rays hit it.

    The depth is None if its mesh cannot be read.
    """
    to_shape = body.pose.inverse()
    if body.shape.kind != "mesh":
        depth = depth_in(body.shape, to_shape.xyz)
        return depth, [] if depth >= 0 else _hits(body, to_shape, into)
    path = body.shape.mesh.path if body.shape.mesh else ""
    x, y, z = body.shape.size
    turned = [rotate(to_shape.quat_xyzw, direction) for direction in into]
    try:
        # Numpy and trimesh: 0.3 s that most robots need not wait for.
        from tfcompose.compiler.rays import meshes  # noqa: PLC0415

        depth = meshes.depth_in(path, (x, y, z), to_shape.xyz)
        far = meshes.distances(path, (x, y, z), to_shape.xyz, turned) if depth < 0 else []
    except Exception:  # noqa: BLE001 (readers of a dozen formats: anything can come out of them)
        return None, []
    return depth, [(index, one) for index, one in enumerate(far) if math.isfinite(one)]


def _hits(body: PosedShape, to_shape: Pose, into: Sequence[Vector]) -> Hits:
    """Return the rays that hit a primitive, and where."""
    (x, y, z), radius = body.pose.xyz, body.shape.radius
    miss = x * x + y * y + z * z - radius * radius
    hits = []
    for index, direction in enumerate(into):
        along = direction[0] * x + direction[1] * y + direction[2] * z
        if miss > 0 and (along <= 0 or along * along < miss):
            continue  # it passes the sphere around the shape
        far = distance(body.shape, to_shape.xyz, rotate(to_shape.quat_xyzw, direction))
        if math.isfinite(far):
            hits.append((index, far))
    return hits
