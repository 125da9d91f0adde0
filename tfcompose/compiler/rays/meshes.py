"""Rays against the triangles of mesh files, by trimesh."""

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
    """Return how far along each ray the mesh begins, endless where it is missed.

    All in the mesh's frame, in metres.

    Raises:
        Exception: whatever a reader raises for a file that is no mesh.
    """
    mesh = _read(path, scale)
    found = np.full(len(directions), np.inf)
    origins = np.tile(origin, (len(directions), 1))
    where, rays, _ = mesh.ray.intersects_location(
        origins, np.asarray(directions), multiple_hits=True
    )
    if len(where):
        np.minimum.at(found, rays, np.linalg.norm(where - origins[rays], axis=1))
    return [float(distance) for distance in found]


def sphere_around(path: str, scale: Vector) -> tuple[Vector, float]:
    """Return the centre of the mesh's box, in its frame, and the radius around that box.

    Raises:
        Exception: whatever a reader raises for a file that is no mesh.
    """
    least, most = (tuple(map(float, corner)) for corner in _read(path, scale).bounds)
    x, y, z = ((low + high) / 2 for low, high in zip(least, most, strict=True))
    return (x, y, z), math.dist(least, most) / 2


def depth_in(path: str, scale: Vector, point: Vector) -> float:
    """Return how deep the point is in the mesh, in metres.

    Negative outside, and in a mesh that is not closed.

    Raises:
        Exception: whatever a reader raises for a file that is no mesh.
    """
    mesh = _read(path, scale)
    is_within = all(
        low <= value <= high
        for low, value, high in zip(mesh.bounds[0], point, mesh.bounds[1], strict=True)
    )
    if not is_within or not mesh.is_watertight:
        return -1.0
    near: Any = trimesh.proximity
    return float(near.signed_distance(mesh, [point])[0])
