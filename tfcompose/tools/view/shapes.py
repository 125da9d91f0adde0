"""Triangles of shapes, reduced in number for a browser."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import trimesh

from tfcompose.compiler.meshes import read_mesh

if TYPE_CHECKING:
    from tfcompose.foundation.geometry import Vector
    from tfcompose.model.robot import Shape

#: The maximum number of triangles of a mesh. The page of an arm with seven links is then smaller
#: than 2 MB.
MOST_TRIANGLES = 20_000


def mesh_of(shape: Shape) -> Any:
    """Return the triangles of a shape in the shape's frame, as a ``trimesh.Trimesh`` in metres.

    A mesh file with more than ``MOST_TRIANGLES`` is decimated to that number (quadric error
    metrics, Garland and Heckbert 1997). Return None if the file is missing or cannot be read.
    """
    size = shape.size
    if shape.kind == "box":
        return trimesh.creation.box(extents=size)
    if shape.kind == "cylinder":
        return trimesh.creation.cylinder(radius=size[0], height=size[1], sections=32)
    if shape.kind == "sphere":
        return trimesh.creation.icosphere(subdivisions=2, radius=size[0])
    if shape.kind == "capsule":
        return trimesh.creation.capsule(radius=size[0], height=size[1], count=[24, 24])
    path = shape.mesh.path if shape.mesh else ""
    try:
        return _decimate(path, (size[0], size[1], size[2]), Path(path).stat().st_mtime_ns)
    except Exception:  # noqa: BLE001 (readers of a dozen formats: anything can come out of them)
        return None


@lru_cache(maxsize=256)
def _decimate(path: str, scale: Vector, _changed_ns: int) -> Any:
    mesh = read_mesh(path, scale)
    if len(mesh.faces) > MOST_TRIANGLES:
        mesh.merge_vertices()  # an STL file repeats a vertex for each of its triangles
        mesh = mesh.simplify_quadric_decimation(face_count=MOST_TRIANGLES)
    return mesh
