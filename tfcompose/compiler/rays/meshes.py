"""Ray casting against mesh files, with trimesh."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
import trimesh

from tfcompose.compiler.meshes import read_mesh

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tfcompose.foundation.geometry import Vector


_read = lru_cache(maxsize=32)(read_mesh)


def distances(
    path: str, scale: Vector, origin: Vector, directions: Sequence[Vector]
) -> list[float]:
    """Return the distance along each ray to the ray's first hit; infinite without a hit.

    Rays are in the mesh's frame, in metres; ``directions`` are unit vectors.

    Raises:
        Exception: any error of trimesh's reader, if the file is not a mesh.
    """
    mesh = _read(path, scale)
    nearest = np.full(len(directions), np.inf)
    origins = np.tile(origin, (len(directions), 1))
    hits, rays, _ = mesh.ray.intersects_location(
        origins, np.asarray(directions), multiple_hits=True
    )
    if len(hits):
        np.minimum.at(nearest, rays, np.linalg.norm(hits - origins[rays], axis=1))
    return [float(distance) for distance in nearest]


def sphere_around(path: str, scale: Vector) -> tuple[Vector, float]:
    """Return the centre and radius of the sphere around the mesh's box, in the mesh's frame.

    Raises:
        Exception: any error of trimesh's reader, if the file is not a mesh.
    """
    lower, upper = (tuple(map(float, corner)) for corner in _read(path, scale).bounds)
    x, y, z = ((low + high) / 2 for low, high in zip(lower, upper, strict=True))
    return (x, y, z), math.dist(lower, upper) / 2


def depth_in(path: str, scale: Vector, point: Vector) -> float:
    """Return how deep the point is in the mesh, in metres.

    Negative outside the mesh, and for a mesh that is not closed.

    Raises:
        Exception: any error of trimesh's reader, if the file is not a mesh.
    """
    mesh = _read(path, scale)
    is_within = all(
        low <= value <= high
        for low, value, high in zip(mesh.bounds[0], point, mesh.bounds[1], strict=True)
    )
    if not is_within or not mesh.is_watertight:
        return -1.0
    proximity: Any = trimesh.proximity
    return float(proximity.signed_distance(mesh, [point])[0])
