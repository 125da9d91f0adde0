"""Decoding of sensor messages into arrays, with rosbags and without ROS."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from rosbags.typesys import Stores, get_typestore

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
        return max(self.frames, key=lambda name: self.frames[name], default="")


@dataclass(frozen=True, slots=True)
class Imu:
    """The measurements of an IMU over time, in the axes of the IMU."""

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
        force, rate = message.linear_acceleration, message.angular_velocity
        topic.rows.append((stamp_s, force.x, force.y, force.z, rate.x, rate.y, rate.z))
        return
    linear, angular = message.twist.twist.linear, message.twist.twist.angular
    topic.child_frame = message.child_frame_id
    topic.rows.append((stamp_s, linear.x, linear.y, angular.z))


def imu_of(topic: MeasuredTopic) -> Imu:
    """Return the finite measurements of an IMU's topic."""
    rows = _array(topic, 7)
    return Imu(rows[:, 0], rows[:, 1:4], rows[:, 4:7])


def odometry_of(topic: MeasuredTopic) -> Odometry:
    """Return the finite measurements of a topic with odometry."""
    rows = _array(topic, 4)
    return Odometry(rows[:, 0], rows[:, 1:3], rows[:, 3])


def _array(topic: MeasuredTopic, columns: int) -> NDArray[np.float64]:
    rows = np.array(topic.rows, dtype=np.float64).reshape(-1, columns)
    rows = rows[np.isfinite(rows).all(axis=1)]
    _, first = np.unique(rows[:, 0], return_index=True)
    return rows[first]
