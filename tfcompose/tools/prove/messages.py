"""Decoding of sensor messages into arrays, with rosbags and without ROS."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from rosbags.typesys import Stores, get_typestore

from tfcompose.foundation.units import LARGEST
from tfcompose.tools.prove.clouds import EVERY_S, Cloud, cloud_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

IMU = "sensor_msgs/msg/Imu"
ODOMETRY = "nav_msgs/msg/Odometry"
IMAGES = ("sensor_msgs/msg/CameraInfo", "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage")
CLOUDS = ("sensor_msgs/msg/LaserScan", "sensor_msgs/msg/PointCloud2")
#: The message types that the checks read.
TYPES = (IMU, ODOMETRY, *CLOUDS, *IMAGES)

_STORE = get_typestore(Stores.ROS2_JAZZY)
_SECOND_NS = 1_000_000_000


@dataclass(slots=True)
class MeasuredTopic:
    """The measurements of a topic."""

    name: str
    type: str
    #: The number of messages by the frame in their headers.
    frames: dict[str, int] = field(default_factory=dict)
    #: The same for messages that cannot be read as this type. The frame is empty if the header
    #: cannot be read either.
    unreadable: dict[str, int] = field(default_factory=dict)
    #: A row of numbers for each message of an IMU or of odometry. ``imu_of`` and ``odometry_of``
    #: read these rows.
    rows: list[tuple[float, ...]] = field(default_factory=list)
    #: The clouds of a LaserScan or PointCloud2, at most one in ``EVERY_S``.
    clouds: list[Cloud] = field(default_factory=list)
    #: ``child_frame_id`` of odometry.
    child_frame: str = ""

    @property
    def frame(self) -> str:
        """The frame of most messages; empty if there are none."""
        frames = self.frames or self.unreadable
        return max(frames, key=lambda name: frames[name], default="")


@dataclass(frozen=True, slots=True)
class Imu:
    """The measurements of an IMU over time, in the axes of the IMU.

    A row of forces or rates is NaN if the IMU reports none.
    """

    #: In seconds, shape (n,), ascending.
    stamps_s: NDArray[np.float64]
    #: The specific force in m/s², shape (n, 3). At rest it points up (REP-145).
    forces: NDArray[np.float64]
    #: Angular velocity in rad/s, shape (n, 3).
    rates: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Odometry:
    """The motion of a base over time, in the axes of the base."""

    #: In seconds, shape (n,), ascending.
    stamps_s: NDArray[np.float64]
    #: Forward and left, in m/s, shape (n, 2).
    velocities: NDArray[np.float64]
    #: In rad/s, counter-clockwise from above, shape (n,).
    yaw_rates: NDArray[np.float64]


def decode(topic: MeasuredTopic, stamp_ns: int, data: bytes) -> None:
    """Decode a message, and add its numbers to its topic.

    Raises:
        Exception: any exception of the library, if the bytes are of another type.
    """
    stamp_s = stamp_ns / _SECOND_NS
    if topic.type in CLOUDS:
        if not topic.clouds or abs(stamp_s - topic.clouds[-1].stamp_s) >= EVERY_S:
            topic.clouds.append(cloud_of(_STORE.deserialize_cdr(data, topic.type), stamp_s))
        return
    if topic.type not in {IMU, ODOMETRY}:
        return
    message: Any = _STORE.deserialize_cdr(data, topic.type)
    if topic.type == IMU:
        force = _reported(message.linear_acceleration, message.linear_acceleration_covariance)
        rate = _reported(message.angular_velocity, message.angular_velocity_covariance)
        topic.rows.append((stamp_s, *force, *rate))
        return
    linear, angular = message.twist.twist.linear, message.twist.twist.angular
    topic.child_frame = message.child_frame_id
    topic.rows.append((stamp_s, linear.x, linear.y, angular.z))


def _reported(vector: Any, covariance: NDArray[np.float64]) -> tuple[float, float, float]:
    """Return a vector of an IMU; NaN if the covariance marks it as absent (sensor_msgs/Imu)."""
    is_absent = float(covariance[0]) == -1
    return (math.nan, math.nan, math.nan) if is_absent else (vector.x, vector.y, vector.z)


def imu_of(topic: MeasuredTopic) -> Imu:
    """Return the measurements of an IMU's topic."""
    rows = _in_order(np.array(topic.rows, dtype=np.float64).reshape(-1, 7))
    return Imu(rows[:, 0], rows[:, 1:4], rows[:, 4:7])


def odometry_of(topic: MeasuredTopic) -> Odometry:
    """Return the measurements of a topic with odometry that are not too large."""
    rows = np.array(topic.rows, dtype=np.float64).reshape(-1, 4)
    rows = _in_order(rows[(np.abs(rows) <= LARGEST).all(axis=1)])
    return Odometry(rows[:, 0], rows[:, 1:3], rows[:, 3])


def _in_order(rows: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the rows by stamp, which is the first column; of equal stamps only the first row."""
    _, first = np.unique(rows[:, 0], return_index=True)
    return rows[first]
