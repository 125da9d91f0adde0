"""The bodies that one mesh file holds: a body that stands apart and faces inwards is no hole.

Integrated as it is, such a body would have a negative mass. A cavity faces the other way too, and is within a body.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any


def facing_alike(mesh: Any) -> Any:
    """Return the mesh with every body facing as its largest one does, and every cavity the other way.

    The mesh has to be closed and wound consistently.
    """
    np: Any = import_module("numpy")
    corners = mesh.vertices[mesh.faces] - mesh.bounds.mean(axis=0)
    signed = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2]))
    body = _bodies(np, mesh.faces, len(mesh.vertices))
    volumes = np.bincount(body, signed)
    outward = np.sign(volumes[np.abs(volumes).argmax()])
    others = np.flatnonzero(volumes * outward < 0)
    solid = corners[volumes[body] * outward > 0]
    apart = [one for one in others if not _is_within(np, corners[body == one][0, 0], solid)]
    if not apart:
        return mesh
    turned, faces = np.isin(body, apart), mesh.faces.copy()
    faces[turned] = faces[turned][:, ::-1]
    return type(mesh)(mesh.vertices, faces, process=False)


def _bodies(np: Any, faces: Any, count: int) -> Any:
    """Return for each face the number of its body: the least of all corners that edges connect with its own."""
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


def _is_within(np: Any, point: Any, corners: Any) -> bool:
    """Return whether the triangles go round the point: the angles under which it sees them are a whole sphere.

    Van Oosterom and Strackee, The Solid Angle of a Plane Triangle, 1983.
    """
    a, b, c = (corners[:, index] - point for index in range(3))
    la, lb, lc = (np.linalg.norm(side, axis=1) for side in (a, b, c))
    volume = np.einsum("ij,ij->i", a, np.cross(b, c))
    dots = [np.einsum("ij,ij->i", *pair) * length for *pair, length in ((a, b, lc), (b, c, la), (c, a, lb))]
    return bool(abs(np.arctan2(volume, la * lb * lc + sum(dots)).sum()) > np.pi)
