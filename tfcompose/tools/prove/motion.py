"""Relation between an IMU's measurements and odometry, by least squares.

Gravity and the accelerations of the base show the rotation of the accelerometer's axes. Yaw rates
show the rotation of the gyroscope's axes. Measurements are averaged over short intervals. Standard
errors come from the scatter between stretches of the recording, so that noise that is correlated
in time does not make them too small.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from tfcompose.foundation.units import LARGEST

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tfcompose.tools.prove.messages import Imu, Odometry

    Array = NDArray[np.float64]

#: The length of the intervals over which measurements are averaged, in seconds.
INTERVAL_S = 0.1
#: The smallest number of intervals for an estimate.
FEWEST = 20
#: The number of stretches into which a recording is divided. The scatter between stretches gives
#: the standard error.
STRETCHES = 8
#: The smallest standard deviations of a motion that is large enough for an estimate, in rad/s and
#: m/s².
LEAST_YAW_RATE = 0.08
LEAST_ACCELERATION = 0.08
#: Why an estimate is unknown.
STEADY = "the base hardly accelerates by odometry: speed up and brake"
_APART = "too few measurements came at the times of odometry"
#: Accelerations are computed from speeds that are averaged over this many intervals.
_SMOOTHED = 5


@dataclass(frozen=True, slots=True)
class Estimate:
    """A vector in an IMU's axes, with the standard error of its direction."""

    #: Shape (3,).
    vector: Array
    #: In radians.
    error_rad: float

    @property
    def length(self) -> float:
        """The length of the vector."""
        return float(np.linalg.norm(self.vector))

    @property
    def direction(self) -> Array:
        """The unit vector in the direction of the vector, shape (3,)."""
        return self.vector / max(self.length, 1e-12)


@dataclass(frozen=True, slots=True)
class Motion:
    """The relation between an IMU's measurements and the motion of the base.

    Instead of an unknown estimate, there is the reason.
    """

    #: The specific force at rest, in m/s². It points up.
    up: Estimate | str
    #: The specific force for a forward acceleration of 1 m/s². It points forward.
    forward: Estimate | str
    #: The measured rate for a yaw rate of 1 rad/s. It points along the yaw axis.
    yaw_axis: Estimate | str


def motion_of(imu: Imu, odometry: Odometry | None, base_xyz: Array) -> Motion:
    """Return the estimates for an IMU at ``base_xyz``, its position in the base in metres."""
    return Motion(
        *_force_estimates(imu, odometry, base_xyz),
        yaw_axis=_yaw_axis(imu, odometry),
    )


def _force_estimates(
    imu: Imu, odometry: Odometry | None, base_xyz: Array
) -> tuple[Estimate | str, Estimate | str]:
    """Return the specific force at rest, and for a forward acceleration."""
    stamps, forces = _measured(imu.stamps_s, imu.forces)
    if len(stamps) < FEWEST:
        reason = _why_few(imu, len(stamps), "acceleration")
        return reason, reason
    at_rest = _regress(np.ones((len(forces), 1)), forces)[0]
    edges = _edges(stamps, odometry)
    if odometry is None or edges is None:
        return at_rest, _APART
    velocities, yaw_rates = _speeds(odometry, edges)
    accelerations = _accelerations(velocities, yaw_rates, base_xyz)
    with_force = np.column_stack([np.ones(len(yaw_rates)), accelerations])
    up, forward, left = _regress(with_force, _smooth(means(stamps, forces, edges)))
    stds = accelerations.std(axis=0)
    if stds[1] > stds[0]:
        forward = Estimate(np.cross(left.vector, up.direction), left.error_rad)
    if max(stds) >= LEAST_ACCELERATION:
        return up, forward
    is_rotated = yaw_rates.std() >= LEAST_YAW_RATE
    return up if is_rotated else at_rest, STEADY


def _yaw_axis(imu: Imu, odometry: Odometry | None) -> Estimate | str:
    """Return the measured rate for a yaw rate of 1 rad/s."""
    stamps, rates = _measured(imu.stamps_s, imu.rates)
    if len(stamps) < FEWEST:
        return _why_few(imu, len(stamps), "angular velocity")
    edges = _edges(stamps, odometry)
    if odometry is None or edges is None:
        return _APART
    _, yaw_rates = _speeds(odometry, edges)
    std = float(yaw_rates.std())
    if std < LEAST_YAW_RATE:
        degrees = math.degrees(std)
        return f"the base hardly rotates by odometry ({degrees:.1f} deg/s): drive curves"
    inputs = np.column_stack([np.ones(len(yaw_rates)), yaw_rates])
    return _regress(inputs, _smooth(means(stamps, rates, edges)))[1]


def _measured(stamps_s: Array, values: Array) -> tuple[Array, Array]:
    """Return the stamps with values to compute with, and these values."""
    is_usable = (np.abs(values) <= LARGEST).all(axis=1)
    return stamps_s[is_usable], values[is_usable]


def _why_few(imu: Imu, count: int, quantity: str) -> str:
    """Return why there is no estimate from ``count`` measurements of a quantity."""
    if len(imu.stamps_s) < FEWEST:
        return "too few messages came"
    few = f"only {count} times an" if count else "no"
    return f"the driver reports {few} {quantity}"


def _edges(stamps_s: Array, odometry: Odometry | None) -> Array | None:
    """Return the edges of the intervals in which both measure, None if they are too few."""
    if odometry is None or len(odometry.stamps_s) < FEWEST:
        return None
    begin = max(stamps_s[0], odometry.stamps_s[0])
    end = min(stamps_s[-1], odometry.stamps_s[-1])
    if end - begin < FEWEST * INTERVAL_S:
        return None
    return np.arange(begin, end, INTERVAL_S)


def _speeds(odometry: Odometry, edges_s: Array) -> tuple[Array, Array]:
    """Return the smooth mean velocities and yaw rates of the base between edges."""
    velocities = means(odometry.stamps_s, odometry.velocities, edges_s)
    yaw_rates = means(odometry.stamps_s, odometry.yaw_rates[:, None], edges_s)
    return _smooth(velocities), _smooth(yaw_rates)[:, 0]


def means(stamps_s: Array, values: Array, edges_s: Array) -> Array:
    """Return the means of values, shape (n, k), between consecutive edges, shape (m - 1, k).

    Between two stamps, the value is the mean of the values at both stamps.
    """
    steps = np.diff(stamps_s)[:, None]
    areas = np.vstack([np.zeros(values.shape[1]), (values[1:] + values[:-1]) / 2 * steps])
    integrals = np.cumsum(areas, axis=0)
    columns = [np.interp(edges_s, stamps_s, column) for column in integrals.T]
    sums: Array = np.diff(np.column_stack(columns), axis=0)
    return sums / np.diff(edges_s)[:, None]


def _smooth(values: Array) -> Array:
    """Return moving averages over ``_SMOOTHED`` rows, which are ``_SMOOTHED - 1`` rows fewer."""
    sums = np.cumsum(np.vstack([np.zeros(values.shape[1]), values]), axis=0)
    smooth: Array = (sums[_SMOOTHED:] - sums[:-_SMOOTHED]) / _SMOOTHED
    return smooth


def _accelerations(velocities: Array, yaw_rates: Array, xyz: Array) -> Array:
    """Return the forward and left accelerations of a point on a base that moves in a plane.

    The result has shape (n, 2), in m/s². The acceleration of the point r is dv/dt + ω × v + dω/dt
    × r + ω × (ω × r).
    """
    (x, y, _), along = xyz, np.gradient(velocities, INTERVAL_S, axis=0)
    angular = np.gradient(yaw_rates, INTERVAL_S)
    forward = along[:, 0] - yaw_rates * velocities[:, 1] - angular * y - yaw_rates**2 * x
    left = along[:, 1] + yaw_rates * velocities[:, 0] + angular * x - yaw_rates**2 * y
    return np.column_stack([forward, left])


def _regress(inputs: Array, outputs: Array) -> list[Estimate]:
    """Solve outputs = inputs · vectors by least squares, with a vector for each column of inputs.

    The standard error comes from solutions that each leave out a stretch (delete-d jackknife).
    """
    vectors = np.linalg.lstsq(inputs, outputs, rcond=None)[0]
    stretches = np.array_split(np.arange(len(inputs)), STRETCHES)
    without = [
        np.linalg.lstsq(
            np.delete(inputs, stretch, axis=0), np.delete(outputs, stretch, axis=0), rcond=None
        )[0]
        for stretch in stretches
    ]
    variances = np.var(without, axis=0).sum(axis=1) * (STRETCHES - 1)
    return [
        Estimate(vector, float(np.sqrt(variance) / max(np.linalg.norm(vector), 1e-12)))
        for vector, variance in zip(vectors, variances, strict=True)
    ]
