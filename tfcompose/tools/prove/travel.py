"""Comparison of the base's motion by odometry with the motion of the points of a sensor.

While the base drives straight, the points move back along x of the base. While the base rotates to
the left, they move to the right. The points of this module are points above the floor, of shape
(n, 2), with x forward and y left, in metres from the sensor. Their axes are those of the declared
mount, after the floor has been made level.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from tfcompose.tools.prove.registration import align_plane, mismatch

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from tfcompose.tools.prove.messages import Odometry

    Array = NDArray[np.float64]

_Pair = TypeVar("_Pair")
#: The shortest and the longest straight drive between two compared clouds, in metres.
LEAST_M, _MOST_M = 0.5, 0.8
#: The largest rotation of the base during a straight drive, in radians.
_STRAIGHT_RAD = math.radians(2)
#: The smallest and the largest rotation between two clouds that show left and right, in radians,
#: and the longest time between them, in seconds.
_LEAST_RAD, _MOST_RAD, _LONGEST_S = math.radians(20), math.radians(60), 4.0
#: The maximum number of compared pairs of clouds, and the minimum number for a result.
_MOST_PAIRS, _FEWEST_PAIRS = 8, 3
#: The number of compared points of a cloud, and the smallest number for a result.
_QUERIES, _FEWEST_POINTS = 250, 60
#: The step between the headings that are tried first, in radians.
_STEP_RAD = math.radians(10)
#: The accepted range of a measured distance, as a factor of odometry's distance.
_SLIP = (0.7, 1.4)
#: A heading is accepted if every other heading fits worse by this many standard errors and by this
#: factor.
_SIGMAS, _WORSE = 4.0, 1.15


@dataclass(frozen=True, slots=True)
class MeasuredHeading:
    """The direction in which a sensor moves while the base drives forward."""

    #: The direction in radians, counter-clockwise from x of the base, with the declared mount.
    yaw_rad: float
    error_rad: float


@dataclass(frozen=True, slots=True)
class BasePath:
    """The poses of the base in the plane over time, from odometry's speeds."""

    #: Shape (n,), ascending.
    stamps_s: Array
    #: x, y and yaw, in metres and radians, shape (n, 3).
    poses: Array

    def poses_at(self, stamps_s: Array) -> Array:
        """Return the poses at these times, shape (m, 3)."""
        columns = [np.interp(stamps_s, self.stamps_s, column) for column in self.poses.T]
        return np.column_stack(columns)

    @property
    def explores(self) -> bool:
        """Whether the base drives and rotates far enough to distinguish walls from the floor."""
        reach = np.ptp(self.poses, axis=0)
        return bool(max(reach[:2]) >= 1.0 and reach[2] >= math.radians(45))


def track_of(odometry: Odometry) -> BasePath:
    """Integrate odometry's speeds to a path (trapezoidal rule)."""
    steps = np.diff(odometry.stamps_s)
    rates = (odometry.yaw_rates[1:] + odometry.yaw_rates[:-1]) / 2
    yaws = np.concatenate([[0.0], np.cumsum(rates * steps)])
    cosines, sines = np.cos(yaws), np.sin(yaws)
    forward, left = odometry.velocities.T
    x, y = forward * cosines - left * sines, forward * sines + left * cosines
    path = [
        np.concatenate([[0.0], np.cumsum((speeds[1:] + speeds[:-1]) / 2 * steps)])
        for speeds in (x, y)
    ]
    return BasePath(odometry.stamps_s, np.column_stack([*path, yaws]))


@dataclass(frozen=True, slots=True)
class Travel:
    """The clouds of a sensor along the path of the base."""

    track: BasePath
    stamps_s: Array
    #: The points of each cloud above the floor, shape (n, 2), in metres.
    clouds: Sequence[Array]

    def heading(self) -> MeasuredHeading | str:
        """Return the heading from clouds of straight drives, or the reason why it is unknown."""
        pairs = list(self._straight_pairs())
        if not pairs:
            return f"the base never drives straight over {LEAST_M:g} m by odometry"
        pairs = [each for each in _spread(pairs) if self._has_points(each[0], each[1])]
        if len(pairs) < _FEWEST_PAIRS:
            return "too few points are above the floor while the base drives straight"
        angles = np.arange(-math.pi, math.pi, _STEP_RAD)
        costs = np.array([self._mismatches(pair, angles) for pair in pairs])
        best = int(costs.mean(axis=0).argmin())
        apart = np.abs((angles - angles[best] + math.pi) % (2 * math.pi) - math.pi)
        distant = np.flatnonzero(apart > math.radians(45))
        rival = distant[costs.mean(axis=0)[distant].argmin()]
        if not _is_clear(costs[:, best], costs[:, rival]):
            return "what it sees looks the same in several directions"
        return self._refine(pairs, float(angles[best]))

    def _refine(
        self, pairs: list[tuple[int, int, float]], yaw_rad: float
    ) -> MeasuredHeading | str:
        """Return the heading from the registration of each pair, with its standard error."""
        offsets = []
        for first, last, distance in pairs:
            begin = distance * np.array([math.cos(yaw_rad), math.sin(yaw_rad), 0.0])
            motion = align_plane(_thin(self.clouds[last]), self.clouds[first], begin)
            if motion is None:
                continue
            scale = math.hypot(*motion[:2]) / abs(distance)
            if not _SLIP[0] < scale < _SLIP[1]:
                continue
            x, y = motion[:2] * np.sign(distance)
            offsets.append((math.atan2(y, x) - yaw_rad + math.pi) % (2 * math.pi) - math.pi)
        if len(offsets) < _FEWEST_PAIRS:
            return "its scans do not match each other"
        offset = float(np.median(offsets))
        # The standard error of the median of a normal distribution.
        error = 1.25 * float(np.std(offsets)) / math.sqrt(len(offsets))
        yaw = (yaw_rad + offset + math.pi) % (2 * math.pi) - math.pi
        return MeasuredHeading(yaw, error)

    def is_mirrored(self, yaw_rad: float, base_xy: Array) -> bool | str:
        """Return whether left and right are swapped, or the reason why this is unknown.

        ``base_xy`` is the position of the sensor in the base, in metres.
        """
        pairs = list(self._rotating_pairs())
        if not pairs:
            return "the base hardly rotates by odometry: drive curves"
        pairs = [pair for pair in _spread(pairs) if self._has_points(*pair)]
        if len(pairs) < _FEWEST_PAIRS:
            return "too few points are above the floor while the base rotates"
        costs = np.array(
            [
                [self._rotated_mismatch(pair, yaw_rad, base_xy, side) for side in (1.0, -1.0)]
                for pair in pairs
            ]
        )
        for mirrored, (right, wrong) in ((False, costs.T), (True, costs.T[::-1])):
            if _is_clear(right, wrong):
                return mirrored
        return "what it sees looks the same to the left and to the right"

    def _straight_pairs(self) -> Iterator[tuple[int, int, float]]:
        """Yield pairs of clouds with a straight drive between them, and its length in metres."""
        poses = self.track.poses_at(self.stamps_s)
        for first in range(len(poses)):
            for last in range(first + 1, len(poses)):
                x, y, yaw = between(poses[first], poses[last])
                if abs(yaw) > _STRAIGHT_RAD or abs(x) > _MOST_M or abs(y) > 0.1 * _MOST_M:
                    break
                if abs(x) >= LEAST_M:
                    yield first, last, x
                    break

    def _rotating_pairs(self) -> Iterator[tuple[int, int]]:
        """Yield pairs of clouds between which the base rotates enough to tell left from right."""
        poses = self.track.poses_at(self.stamps_s)
        for first in range(len(poses)):
            for last in range(first + 1, len(poses)):
                if self.stamps_s[last] - self.stamps_s[first] > _LONGEST_S:
                    break
                angle = abs(poses[last, 2] - poses[first, 2])
                if angle > _MOST_RAD:
                    break
                if angle >= _LEAST_RAD:
                    yield first, last
                    break

    def _has_points(self, *clouds: int) -> bool:
        return all(len(self.clouds[cloud]) >= _FEWEST_POINTS for cloud in clouds[:2])

    def _mismatches(self, pair: tuple[int, int, float], angles: Array) -> list[float]:
        """Return the mismatch of a pair of clouds for each heading, in metres."""
        first, last, distance = pair
        points, reference = _thin(self.clouds[last]), self.clouds[first]
        return [
            mismatch(points + distance * np.array([math.cos(angle), math.sin(angle)]), reference)
            for angle in angles
        ]

    def _rotated_mismatch(
        self, pair: tuple[int, int], yaw_rad: float, base_xy: Array, side: float
    ) -> float:
        """Return the mismatch of two clouds after the base's motion; mirrored if side is -1."""
        first, last = self.track.poses_at(self.stamps_s[list(pair)])
        x, y, yaw = between(first, last)
        points, reference = (
            _rotate(self.clouds[cloud], -yaw_rad) * [1.0, side] + base_xy for cloud in pair[::-1]
        )
        return mismatch(_rotate(_thin(points), yaw) + np.array([x, y]), reference)


def between(first: Array, last: Array) -> tuple[float, float, float]:
    """Return the pose (x, y, yaw) ``last`` in the frame of the pose ``first``."""
    x, y = _rotate((last[:2] - first[:2])[None], -float(first[2]))[0]
    return float(x), float(y), float(last[2] - first[2])


def _rotate(points: Array, angle: float) -> Array:
    cosine, sine = math.cos(angle), math.sin(angle)
    rotated: Array = points @ np.array([[cosine, sine], [-sine, cosine]])
    return rotated


def _thin(points: Array) -> Array:
    return points[:: max(1, len(points) // _QUERIES)]


def _spread(pairs: list[_Pair]) -> list[_Pair]:
    """Return at most ``_MOST_PAIRS`` pairs, spread evenly."""
    indices = np.linspace(0, len(pairs) - 1, min(len(pairs), _MOST_PAIRS))
    return [pairs[index] for index in np.unique(indices.round().astype(int))]


def _is_clear(best: Array, rival: Array) -> bool:
    """Return whether a hypothesis fits clearly better than another, by the scatter of pairs."""
    differences = rival - best
    error = float(differences.std()) / math.sqrt(len(differences)) + 1e-9
    mean = float(differences.mean())
    return mean > _SIGMAS * error and float(rival.mean()) > _WORSE * float(best.mean())
