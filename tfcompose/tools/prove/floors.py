"""Detection of the floor in a sensor's points.

The floor is a plane that does not move in the sensor's frame while the robot drives and rotates.
Walls are planes too, but they move in this frame. The robot is assumed to be level with the floor.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from tfcompose.tools.prove.rotations import angle_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from tfcompose.tools.prove.clouds import Cloud

    Array = NDArray[np.float64]

#: The number of triples of points through which the search tries planes, and the number of points
#: from which it takes them.
_TRIPLES, _SEARCHED = 1500, 4000
#: The distances in metres within which a point belongs to a plane: during the search, and for the
#: fit.
_SEARCH_M, _FIT_M = 0.08, 0.12
#: The largest distance of a point, in metres. Noise and small slopes have a larger effect at
#: larger distances.
_FAR_M = 5.0
#: The floor must have at least the first share of all points, must be in at least the second share
#: of the clouds, and may have at most the third share of points beyond it.
_LEAST_SHARE, _LEAST_CLOUDS, _MOST_BEYOND = 0.06, 0.8, 0.04
#: The number of groups of clouds. The scatter between groups gives the standard error.
_GROUPS = 8
_FEWEST_POINTS = 100
#: The largest angle in radians at which two planes count as the same.
_SAME_RAD = math.radians(15)


@dataclass(frozen=True, slots=True)
class Plane:
    """A plane in a sensor's frame, with standard errors."""

    #: The unit normal, of shape (3,), from the plane towards the sensor. For a floor it points up.
    normal: Array
    #: The distance of the frame's origin from the plane, in metres.
    distance_m: float
    #: The standard error of the normal, in radians.
    error_rad: float = 0.0
    #: The standard error of the distance, in metres.
    error_m: float = 0.0


def planes_of(clouds: Sequence[Cloud]) -> list[Plane]:
    """Return planes that bound all clouds and do not move; planes with most points come first."""
    near = [cloud.points[np.linalg.norm(cloud.points, axis=1) < _FAR_M] for cloud in clouds]
    near = [points for points in near if len(points) >= _FEWEST_POINTS // 4]
    if len(near) < _GROUPS or len(near) < len(clouds) / 2:
        return []
    generator = np.random.default_rng(0)
    points = np.vstack(near)
    searched = points[generator.integers(0, len(points), _SEARCHED)]
    planes: list[Plane] = []
    tried: list[Array] = []
    for normal, distance in _candidates(searched, generator):
        if any(angle_of(normal, earlier_normal) < _SAME_RAD for earlier_normal in tried):
            continue
        tried.append(normal)
        plane = _fit_groups(near, normal, distance)
        if plane is None or not _bounds_all(near, plane):
            continue
        if all(angle_of(plane.normal, accepted.normal) > _SAME_RAD for accepted in planes):
            planes.append(plane)
    return planes


def _candidates(points: Array, generator: np.random.Generator) -> list[tuple[Array, float]]:
    """Return planes through random triples of points, best first (RANSAC)."""
    corners = points[generator.integers(0, len(points), (_TRIPLES, 3))]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    normals = normals[lengths > _SEARCH_M] / lengths[lengths > _SEARCH_M, None]
    distances = -(normals * corners[lengths > _SEARCH_M, 0]).sum(axis=1)
    signs = np.where(distances < 0, -1.0, 1.0)
    normals, distances = normals * signs[:, None], distances * signs
    heights = points @ normals.T + distances
    shares = (np.abs(heights) < _SEARCH_M).mean(axis=0)
    beyond = (heights < -2 * _SEARCH_M).mean(axis=0)
    fits = (shares >= _LEAST_SHARE) & (beyond <= _MOST_BEYOND)
    order = np.flatnonzero(fits)[np.argsort(-shares[fits])]
    return [(normals[index], float(distances[index])) for index in order]


def _fit_groups(near: list[Array], normal: Array, distance_m: float) -> Plane | None:
    """Fit a plane near the given plane, with standard errors from the scatter between groups."""
    groups = [np.vstack(near[index::_GROUPS]) for index in range(_GROUPS)]
    together = _fit(np.vstack(near), normal, distance_m)
    if together is None:
        return None
    fits = [_fit(points, *together) for points in groups]
    present = [each for each in fits if each is not None]
    if len(present) < _GROUPS:
        return None
    normals = np.array([each[0] for each in present])
    distances = np.array([each[1] for each in present])
    error_rad = math.sqrt(float(normals.var(axis=0).sum()) / (_GROUPS - 1))
    error_m = float(distances.std()) / math.sqrt(_GROUPS - 1)
    return Plane(together[0], together[1], error_rad, error_m)


def _fit(points: Array, normal: Array, distance_m: float) -> tuple[Array, float] | None:
    """Fit a plane to the points near the given plane, by least squares.

    The normal is the direction in which the points scatter least.
    """
    limit = 2 * _FIT_M
    for _ in range(6):
        heights = points @ normal + distance_m
        part = points[np.abs(heights) < limit]
        if len(part) < _FEWEST_POINTS // 4:
            return None
        center = part.mean(axis=0)
        values, vectors = np.linalg.eigh(np.cov((part - center).T))
        if values[1] < 4 * values[0]:
            return None
        normal = vectors[:, 0] * (1.0 if vectors[:, 0] @ normal > 0 else -1.0)
        distance_m = -float(normal @ center)
        limit = min(_FIT_M, max(0.02, 3 * math.sqrt(values[0])))
    return (normal, distance_m) if distance_m > 0 else None


def _bounds_all(near: list[Array], plane: Plane) -> bool:
    """Return whether a plane is in most clouds, and nearly no points are beyond it."""
    heights = [points @ plane.normal + plane.distance_m for points in near]
    present = [(np.abs(each) < _FIT_M).mean() >= _LEAST_SHARE / 2 for each in heights]
    beyond = (np.concatenate(heights) < -2 * _FIT_M).mean()
    return float(np.mean(present)) >= _LEAST_CLOUDS and float(beyond) <= _MOST_BEYOND
