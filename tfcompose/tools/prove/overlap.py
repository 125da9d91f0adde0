"""Check of two sensors that see the same surfaces.

The check moves the second sensor's points until they fit the first sensor's points. The residual
is this motion. It is zero if both mounts fit each other, but does not show which of the two is
wrong. Points have shape (n, 3), in metres, in the base; the declared mounts give their positions.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from tfcompose.tools.prove.registration import nearest, surfaces_of
from tfcompose.tools.prove.rotations import matrix_of, rotation_of
from tfcompose.tools.prove.travel import between
from tfcompose.tools.prove.verdict import CheckResult

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from tfcompose.foundation.geometry import Pose
    from tfcompose.tools.prove.clouds import Cloud
    from tfcompose.tools.prove.travel import BasePath

    Array = NDArray[np.float64]
    #: The matrix and the right side of normal equations, and the median squared distance in m².
    _Equations = tuple[Array, Array, float]

CHECK = "overlap"
#: The largest differences in time between two compared clouds, in seconds: with odometry, and
#: without. Without odometry, the clouds must be from the same time.
_APART_S, _SAME_S = 0.1, 0.005
#: The largest distance between a point and its sensor, in metres.
_FAR_M = 6.0
#: The maximum number of compared pairs of clouds, and the minimum number for a result.
_MOST_PAIRS, _FEWEST_PAIRS = 8, 4
#: The number of compared points of each second cloud.
_QUERIES = 500
#: The largest distance between matching points in each iteration, in metres.
_REACHES_M = (0.6, 0.6, 0.5, 0.5, *(0.4,) * 12)
#: The smallest share and the smallest number of points that must match the other sensor's points.
_LEAST_SHARE, _FEWEST_POINTS = 0.25, 60
#: The largest standard errors of a usable result: of the position in metres, and of the rotation
#: in radians.
_VAGUE_M, _VAGUE_RAD = 0.03, math.radians(1.5)
#: The smallest usable excitation (``_excitation``), and the lever in metres that converts
#: rotations to lengths in it.
_LEAST_EXCITATION, _LEVER_M = 0.03, 3.0
#: The part of the noise by which registration can be wrong, because noise along the rays moves
#: surfaces towards each other.
_OF_NOISE = 0.5
#: A measurement differs only if it exceeds its limit by this many standard errors.
_SIGMAS = 3.0


@dataclass(frozen=True, slots=True)
class Residual:
    """The motion in the base after which the second sensor's points fit the first sensor's."""

    #: The rotation vector in radians, shape (3,).
    rotation: Array
    #: The translation in metres, shape (3,). It follows after the rotation about the base's
    #: origin.
    offset: Array
    #: The standard errors of rotation and translation, shape (6,), from the scatter between pairs.
    errors: Array
    #: The typical distance of points from the other sensor's surfaces, in metres.
    noise_m: float

    @property
    def matrix(self) -> Array:
        """The rotation as a matrix, shape (3, 3)."""
        return rotation_of(self.rotation)

    def move(self, xyz: Array) -> Array:
        """Return the position of a point of the second sensor after the motion."""
        moved: Array = self.matrix @ xyz + self.offset
        return moved


def pairs_of(
    first: Sequence[Cloud], second: Sequence[Cloud], path: BasePath | None
) -> list[tuple[Cloud, Cloud]]:
    """Return pairs of clouds at nearly the same time, spread over the recording."""
    if not first or not second:
        return []
    stamps = np.array([cloud.stamp_s for cloud in second])
    apart = [int(np.abs(stamps - cloud.stamp_s).argmin()) for cloud in first]
    limit = _SAME_S if path is None else _APART_S
    pairs = [
        (cloud, second[index])
        for cloud, index in zip(first, apart, strict=True)
        if abs(second[index].stamp_s - cloud.stamp_s) <= limit
    ]
    chosen = np.linspace(0, len(pairs) - 1, min(len(pairs), _MOST_PAIRS)).round().astype(int)
    return [pairs[index] for index in chosen]


def points_in_base(
    pair: tuple[Cloud, Cloud], poses: Sequence[Pose], path: BasePath | None
) -> tuple[Array, Array]:
    """Return the points of two clouds in the base at the time of the first cloud.

    ``poses`` are the poses of both sensors' frames in the base. Between the two clouds, the base
    moves along ``path``.
    """
    first, second = (
        cloud.points[np.linalg.norm(cloud.points, axis=1) < _FAR_M] @ matrix_of(pose.quat_xyzw).T
        + np.array(pose.xyz)
        for cloud, pose in zip(pair, poses, strict=True)
    )
    if path is not None:
        before, after = path.poses_at(np.array([cloud.stamp_s for cloud in pair]))
        x, y, yaw = between(before, after)
        second = second @ rotation_of(np.array([0.0, 0.0, yaw])).T + np.array([x, y, 0.0])
    return first, second


def residual_of(pairs: Sequence[tuple[Array, Array]]) -> Residual | str:
    """Return the residual of pairs of clouds in the base, or the reason why it is unknown."""
    if len(pairs) < _FEWEST_PAIRS:
        return "too few of their clouds come at the same time"
    pairs = [pair for pair in pairs if min(map(len, pair)) >= _FEWEST_POINTS]
    surfaces = [surfaces_of(reference) for reference, _ in pairs]
    queries = [points[:: max(1, len(points) // _QUERIES)] for _, points in pairs]
    motion = np.zeros(6)
    systems: list[_Equations] = []
    for reach in _REACHES_M:
        equations = [
            _equations(motion, points, *surface, reach)
            for points, surface in zip(queries, surfaces, strict=True)
        ]
        systems = [each for each in equations if each is not None]
        if len(systems) < _FEWEST_PAIRS:
            return "they hardly see the same surfaces"
        motion = _compose(motion, _solve(systems))
    if _excitation(systems) < _LEAST_EXCITATION:
        return "what both see fixes too few directions"
    without = np.array(
        [_solve(systems[:index] + systems[index + 1 :]) for index in range(len(systems))]
    )
    # The scatter of solutions that each leave out a pair (jackknife).
    errors = np.sqrt(without.var(axis=0) * (len(systems) - 1))
    if errors[:3].max() > _VAGUE_RAD or errors[3:].max() > _VAGUE_M:
        return "what both see fixes too few directions"
    noise = math.sqrt(float(np.mean([each[2] for each in systems])))
    return Residual(motion[:3], motion[3:], errors, noise)


def judge_overlap(
    residual: Residual | str, names: tuple[str, str], xyz: Array, limit_m: float, limit_rad: float
) -> CheckResult:
    """Judge a residual. ``xyz`` is the position of the second sensor in the base, in metres."""
    if isinstance(residual, str):
        return CheckResult(CHECK, "cannot tell", f"with {names[0]}: {residual}")
    gap = residual.move(xyz) - xyz
    distance, angle = float(np.linalg.norm(gap)), float(np.linalg.norm(residual.rotation))
    error_rad = float(np.linalg.norm(residual.errors[:3]))
    error_m = math.hypot(*residual.errors[3:], _OF_NOISE * residual.noise_m)
    values = {"off_m": distance, "error_m": error_m, "off_rad": angle, "error_rad": error_rad}
    text = (
        f"{1e3 * distance:.0f} ± {max(1.0, 1e3 * error_m):.0f} mm and {math.degrees(angle):.1f} ±"
        f" {max(0.1, math.degrees(error_rad)):.1f} deg"
    )
    near = distance <= limit_m + _SIGMAS * error_m
    if near and angle <= limit_rad + _SIGMAS * error_rad:
        return CheckResult(CHECK, "agrees", f"{text} from {names[0]}", values=values)
    x, y, z = (round(1e3 * float(value)) + 0 for value in gap)
    text = f"sees surfaces {text} away from where {names[0]} sees them"
    advice = f"if {names[0]} is right, move {names[1]} by [{x}, {y}, {z}] mm in the base"
    if angle > limit_rad:
        rolled = ", ".join(f"{math.degrees(value):.1f}" for value in residual.rotation)
        advice += f", and rotate it by [{rolled}] deg about the base's axes"
    return CheckResult(CHECK, "differs", text, "TF654", advice, values=values)


def _equations(
    motion: Array, points: Array, reference: Array, normals: Array, reach_m: float
) -> _Equations | None:
    """Return the weighted normal equations for a small additional motion (point-to-plane ICP)."""
    if len(reference) < _FEWEST_POINTS:
        return None
    moved = points @ rotation_of(motion[:3]).T + motion[3:]
    distances, index = nearest(moved, reference)
    near = distances < reach_m
    if near.sum() < max(_FEWEST_POINTS, _LEAST_SHARE * len(points) * reach_m):
        return None
    across = normals[index[near]]
    gaps = ((reference[index[near]] - moved[near]) * across).sum(axis=1)
    system = np.column_stack([np.cross(moved[near], across), across])
    scale = max(0.01, 1.5 * float(np.median(np.abs(gaps))))
    weights = 1 / (1 + (gaps / scale) ** 2)
    weighted = system * weights[:, None]
    return weighted.T @ system, weighted.T @ gaps, float(np.median(np.abs(gaps))) ** 2


def _excitation(systems: list[_Equations]) -> float:
    """Return how well the points determine the worst direction of a motion, from 0 to 1.

    This is the smallest eigenvalue of the normal equations divided by their mean, after the lever
    ``_LEVER_M`` has converted rotations to lengths. It is 1 if all directions are determined
    equally well.
    """
    scale = np.array([1 / _LEVER_M] * 3 + [1.0] * 3)
    matrix = np.sum([each[0] for each in systems], axis=0) * np.outer(scale, scale)
    values = np.linalg.eigvalsh(matrix)
    return float(values[0] / values.mean())


def _solve(systems: list[_Equations]) -> Array:
    left = np.sum([each[0] for each in systems], axis=0)
    right = np.sum([each[1] for each in systems], axis=0)
    solution: Array = np.linalg.lstsq(left, right, rcond=1e-6)[0]
    return solution


def _compose(motion: Array, step: Array) -> Array:
    """Return a motion followed by a small motion."""
    rotation = rotation_of(step[:3])
    together = rotation @ rotation_of(motion[:3])
    skew = np.array(
        [
            together[2, 1] - together[1, 2],
            together[0, 2] - together[2, 0],
            together[1, 0] - together[0, 1],
        ]
    )
    sine = float(np.linalg.norm(skew)) / 2
    angle = math.atan2(sine, (float(np.trace(together)) - 1) / 2)
    vector = skew / 2 * (angle / sine if sine > 1e-12 else 1.0)  # noqa: PLR2004 (rounding)
    return np.concatenate([vector, rotation @ motion[3:] + step[3:]])
