"""Volume, centre and moments of inertia of the solid inside a mesh, computed by trimesh."""

from __future__ import annotations

import math
import warnings
from typing import TYPE_CHECKING, Any

import numpy as np

from tfcompose.compiler.meshes import read_mesh
from tfcompose.compiler.urdf.inertia import Moments, UnmeasurableError

if TYPE_CHECKING:
    from tfcompose.foundation.geometry import Vector

#: A volume below this fraction of the size cubed is the rounding error of a flat mesh.
_FLAT = 1e-12


def moments(path: str, scale: Vector) -> Moments:
    """Return volume, centre and tensor of a closed mesh at a scale, in metres.

    Raises:
        UnmeasurableError: if the file is not a mesh, or the mesh is not closed, or its faces have
            inconsistent orientations.
    """
    try:
        mesh = read_mesh(path, scale)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # numpy warns about divisions by a volume of 0
            why = _why_open(mesh)
            mesh = mesh if why else _facing_alike(mesh)
            why = why or _why_flat(mesh)
            volume = 0.0 if why else float(mesh.volume)
    except Exception as error:  # noqa: BLE001 (readers of a dozen formats: anything can come out of them)
        reason = " ".join(str(error).split()) or type(error).__name__
        raise UnmeasurableError(
            "TF725", f"it cannot be read: {reason}", "use STL, OBJ or PLY, or give inertia"
        ) from None
    if not 0 < abs(volume) < math.inf:
        advice = "fix it, give a closed collision shape, or give mass and inertia"
        raise UnmeasurableError("TF725", why or "it has no volume", advice)
    mesh.density = math.copysign(1.0, volume)  # negative if all triangles face inwards
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = mesh.moment_inertia.tolist()
    x, y, z = mesh.center_mass.tolist()
    return Moments(abs(volume), (x, y, z), (xx, xy, xz, yy, yz, zz))


def _why_open(mesh: Any) -> str:
    """Return why the triangles do not enclose a volume; empty if they do."""
    if not len(mesh.faces):
        return "it has no triangles"
    if not mesh.is_watertight:
        return "it is not closed, so it has no volume"
    if not mesh.is_winding_consistent:
        return "some of its triangles face inwards and others outwards, so it has no volume"
    return ""


def _why_flat(mesh: Any) -> str:
    return "" if abs(mesh.volume) > _FLAT * mesh.scale**3 else "it is flat, so it has no volume"


def _facing_alike(mesh: Any) -> Any:
    """Return the mesh with consistent orientation: bodies face outwards, cavities inwards.

    A body that faces inwards would get a negative mass, so it is turned. A cavity also faces
    inwards, but is inside another body, so it is kept. The mesh must be closed, with consistent
    winding.
    """
    corners = mesh.vertices[mesh.faces] - mesh.bounds.mean(axis=0)
    signed = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2]))
    body = _bodies(mesh.faces, len(mesh.vertices))
    volumes = np.bincount(body, signed)
    outward = np.sign(volumes[np.abs(volumes).argmax()])
    inward = np.flatnonzero(volumes * outward < 0)
    solid = corners[volumes[body] * outward > 0]
    apart = [number for number in inward if not _is_within(corners[body == number][0, 0], solid)]
    if not apart:
        return mesh
    turned, faces = np.isin(body, apart), mesh.faces.copy()
    faces[turned] = faces[turned][:, ::-1]
    return type(mesh)(mesh.vertices, faces, process=False)


def _bodies(faces: Any, count: int) -> Any:
    """Return the number of each face's body.

    The number is the smallest vertex index among all vertices that edges connect with the face.
    """
    least = np.arange(count)
    ends = np.concatenate((faces[:, :2], faces[:, 1:]))
    while True:
        ends = np.sort(least[ends], axis=1)
        ends = ends[ends[:, 0] < ends[:, 1]]
        if not len(ends):
            return np.unique(least[faces[:, 0]], return_inverse=True)[1]
        np.minimum.at(least, ends[:, 1], ends[:, 0])
        while (least[least] != least).any():
            least = least[least]


def _is_within(point: Any, corners: Any) -> bool:
    """Return whether the triangles enclose the point.

    They do if the solid angles of the triangles from the point add up to a full sphere. Source:
    van Oosterom and Strackee, The Solid Angle of a Plane Triangle, 1983.
    """
    a, b, c = (corners[:, index] - point for index in range(3))
    la, lb, lc = (np.linalg.norm(side, axis=1) for side in (a, b, c))
    volume = np.einsum("ij,ij->i", a, np.cross(b, c))
    dots = [
        np.einsum("ij,ij->i", *pair) * length
        for *pair, length in ((a, b, lc), (b, c, la), (c, a, lb))
    ]
    return bool(abs(np.arctan2(volume, la * lb * lc + sum(dots)).sum()) > np.pi)
