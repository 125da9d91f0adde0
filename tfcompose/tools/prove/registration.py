"""Registration of clouds: the motion after which the points of a cloud fit another cloud.

Points have shape (n, k), in metres. Clouds have at most some thousand points, so it is fast enough
to compute the distances between all of them.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

#: The maximum of a distance in ``mismatch``, in metres. Larger distances count as this distance.
REACH_M = 0.3
#: The number of neighbours from which a normal is computed.
_NEIGHBOURS = 7
_ITERATIONS = 15
#: Ratios of the variances of neighbours in their three principal directions, in which they are on
#: a surface. The second largest variance is at least the first ratio times the largest. The
#: smallest variance is at most the second ratio times the second largest.
_LEAST_WIDTH, _FLAT = 0.04, 0.15


def nearest(points: Array, reference: Array) -> tuple[Array, NDArray[np.intp]]:
    """Return the distance and the index of the nearest reference point, for each point."""
    squares = (reference**2).sum(axis=1) - 2 * points @ reference.T
    index = squares.argmin(axis=1)
    squared = squares[np.arange(len(points)), index] + (points**2).sum(axis=1)
    return np.sqrt(np.maximum(squared, 0.0)), index


def mismatch(points: Array, reference: Array) -> float:
    """Return the mean distance of points to the reference.

    Distances larger than ``REACH_M`` count as ``REACH_M``.
    """
    distances, _ = nearest(points, reference)
    return float(np.minimum(distances, REACH_M).mean())


def normals_of(points: Array) -> Array:
    """Return a unit normal at each point: the direction in which neighbours scatter least."""
    normals: Array = _scatter(points)[1][:, :, 0]
    return normals


def surfaces_of(points: Array) -> tuple[Array, Array]:
    """Return the points on flat surfaces, of shape (n, 3), with the unit normals there.

    If the neighbours of a point are on an edge or in a row, the point has no normal.
    """
    values, vectors = _scatter(points)
    flat = (values[:, 1] > _LEAST_WIDTH * values[:, 2]) & (values[:, 0] < _FLAT * values[:, 1])
    return points[flat], vectors[flat, :, 0]


def _scatter(points: Array) -> tuple[Array, Array]:
    """Return the eigenvalues, ascending, and eigenvectors of the neighbours' covariance."""
    squares = (points**2).sum(axis=1)
    distances = squares[:, None] + squares[None, :] - 2 * points @ points.T
    neighbours = points[np.argpartition(distances, _NEIGHBOURS, axis=1)[:, : _NEIGHBOURS + 1]]
    offsets = neighbours - neighbours.mean(axis=1, keepdims=True)
    values, vectors = np.linalg.eigh(np.einsum("nki,nkj->nij", offsets, offsets))
    return values, vectors


def align_plane(points: Array, reference: Array, begin: Array) -> Array | None:
    """Return the motion (x, y, angle) in a plane after which points fit the reference.

    Distances are measured along the normals of the reference (point-to-line ICP), with Cauchy
    weights. Return None if too few points are near the reference.
    """
    normals = normals_of(reference)
    x, y, angle = (float(value) for value in begin)
    for _ in range(_ITERATIONS):
        cosine, sine = math.cos(angle), math.sin(angle)
        moved = points @ np.array([[cosine, sine], [-sine, cosine]]) + [x, y]
        distances, index = nearest(moved, reference)
        near = distances < REACH_M
        if near.sum() < _NEIGHBOURS * 3:
            return None
        across = normals[index[near]]
        gaps = ((reference[index[near]] - moved[near]) * across).sum(axis=1)
        levers = moved[near] - [x, y]
        rotating = across[:, 1] * levers[:, 0] - across[:, 0] * levers[:, 1]
        system = np.column_stack([across, rotating])
        scale = max(0.01, 1.5 * float(np.median(np.abs(gaps))))
        weights = 1 / (1 + (gaps / scale) ** 2)
        weighted = system * weights[:, None]
        step = np.linalg.lstsq(weighted.T @ system, weighted.T @ gaps, rcond=1e-6)[0]
        x, y, angle = x + step[0], y + step[1], angle + step[2]
        if np.abs(step).max() < 1e-4:  # noqa: PLR2004 (0.1 mm)
            break
    return np.array([x, y, angle])
