"""Messages of sensors as arrays, decoded with rosbags' types, without ROS."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from rosbags.typesys import Stores, get_typestore

if TYPE_CHECKING:
    from numpy.typing import NDArray

IMU = "sensor_msgs/msg/Imu"
ODOMETRY = "nav_msgs/msg/Odometry"
IMAGES = ("sensor_msgs/msg/CameraInfo", "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage")
CLOUDS = ("sensor_msgs/msg/LaserScan", "sensor_msgs/msg/PointCloud2")
#: The types that are read.
TYPES = (IMU, ODOMETRY, *CLOUDS, *IMAGES)

_STORE = get_typestore(Stores.ROS2_JAZZY)
_SECOND_NS = 1_000_000_000


@dataclass(slots=True)
class MeasuredTopic:
    """What came on one topic."""

    name: str
    type: str
    #: The number of messages by the frame in their headers.
    frames: dict[str, int] = field(default_factory=dict)
    #: Rows of numbers, for the types that are decoded; as ``Imu`` and ``Odometry`` have them.
    rows: list[tuple[float, ...]] = field(default_factory=list)
    #: ``child_frame_id`` of odometry.
    child_frame: str = ""

    @property
    def frame(self) -> str:
        """The frame of most messages; empty if there are none."""
        return max(self.frames, key=lambda name: self.frames[name], default="")


@dataclass(frozen=True, slots=True)
class Imu:
    """An IMU's measurements over time, in its own axes."""

    #: In seconds, shape (n,), ascending.
    stamps_s: NDArray[np.float64]
    #: Specific force in m/s², shape (n, 3): at rest it points up (REP-145).
    forces: NDArray[np.float64]
    #: Angular velocity in rad/s, shape (n, 3).
    rates: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Odometry:
    """A base's motion over time, in its own axes."""

    #: In seconds, shape (n,), ascending.
    stamps_s: NDArray[np.float64]
    #: Forward and left, in m/s, shape (n, 2).
    velocities: NDArray[np.float64]
    #: In rad/s, counter-clockwise from above, shape (n,).
    yaw_rates: NDArray[np.float64]


def decode(topic: MeasuredTopic, data: bytes) -> None:
    """Add a message's numbers to its topic.

    Raises:
        Exception: whatever the library raises for bytes of another type.
    """
    if topic.type not in {IMU, ODOMETRY}:
        return
    message: Any = _STORE.deserialize_cdr(data, topic.type)
    stamp = message.header.stamp
    stamp_s = stamp.sec + stamp.nanosec / _SECOND_NS
    if topic.type == IMU:
        force, rate = message.linear_acceleration, message.angular_velocity
        topic.rows.append((stamp_s, force.x, force.y, force.z, rate.x, rate.y, rate.z))
        return
    linear, angular = message.twist.twist.linear, message.twist.twist.angular
    topic.child_frame = message.child_frame_id
    topic.rows.append((stamp_s, linear.x, linear.y, angular.z))


def imu_of(topic: MeasuredTopic) -> Imu:
    """Return the measurements of an IMU's topic, those that are numbers."""
    rows = _array(topic, 7)
    return Imu(rows[:, 0], rows[:, 1:4], rows[:, 4:7])


def odometry_of(topic: MeasuredTopic) -> Odometry:
    """Return the motion on a topic of odometry, as far as it is numbers."""
    rows = _array(topic, 4)
    return Odometry(rows[:, 0], rows[:, 1:3], rows[:, 3])


def _array(topic: MeasuredTopic, columns: int) -> NDArray[np.float64]:
    rows = np.array(topic.rows, dtype=np.float64).reshape(-1, columns)
    rows = rows[np.isfinite(rows).all(axis=1)]
    _, first = np.unique(rows[:, 0], return_index=True)
    return rows[first]
