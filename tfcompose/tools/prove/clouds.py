"""Points of LaserScan and PointCloud2 messages, reduced in number for the checks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

#: The shortest time between two clouds of a topic, in seconds. Clouds in between are skipped.
EVERY_S = 0.19
#: The maximum number of points of a cloud. Points are removed evenly.
MOST_POINTS = 1500
#: The range of distances of points, in metres. Nearer points belong to the robot itself; farther
#: points are too sparse.
NEAR_M, FAR_M = 0.15, 15.0
#: numpy's types by the constants FLOAT32 and FLOAT64 of sensor_msgs/PointField.
_FLOATS = {7: "f4", 8: "f8"}


@dataclass(frozen=True, slots=True)
class Cloud:
    """The points that a sensor measured at a time."""

    stamp_s: float
    #: The points, of shape (n, 3), in metres, in the frame of the message's header.
    points: Array
    #: Whether all points are in a plane of the frame, as in a LaserScan.
    is_scan: bool = False


def cloud_of(message: Any, stamp_s: float) -> Cloud:
    """Return the reduced points of a LaserScan or PointCloud2.

    Raises:
        Exception: if the fields of the message contradict each other.
    """
    is_scan = hasattr(message, "ranges")
    points = _points_of_scan(message) if is_scan else _points_of_cloud(message)
    distances = np.linalg.norm(points, axis=1)
    points = points[(distances > NEAR_M) & (distances < FAR_M)]
    if len(points) > MOST_POINTS:
        generator = np.random.default_rng(0)
        points = points[generator.choice(len(points), MOST_POINTS, replace=False)]
    return Cloud(stamp_s, points, is_scan)


def _points_of_scan(scan: Any) -> Array:
    """Return the points of a LaserScan, whose angles count from x towards y (sensor_msgs)."""
    ranges = np.asarray(scan.ranges, dtype=np.float64)
    angles = scan.angle_min + scan.angle_increment * np.arange(len(ranges))
    valid = np.isfinite(ranges) & (ranges >= scan.range_min) & (ranges <= scan.range_max)
    ranges, angles = ranges[valid], angles[valid]
    return np.column_stack(
        [ranges * np.cos(angles), ranges * np.sin(angles), np.zeros(len(ranges))]
    )


def _points_of_cloud(cloud: Any) -> Array:
    """Return the points of a PointCloud2 whose coordinates are finite."""
    order = ">" if cloud.is_bigendian else "<"
    fields = {each.name: each for each in cloud.fields}
    layout = np.dtype(
        {
            "names": ["x", "y", "z"],
            "formats": [order + _FLOATS[fields[name].datatype] for name in "xyz"],
            "offsets": [fields[name].offset for name in "xyz"],
            "itemsize": cloud.point_step,
        }
    )
    data = np.asarray(cloud.data, dtype=np.uint8)
    rows = data[: cloud.height * cloud.row_step].reshape(cloud.height, cloud.row_step)
    rows = np.ascontiguousarray(rows[:, : cloud.width * cloud.point_step])
    cells = rows.reshape(-1).view(layout)
    points = np.column_stack([cells[name].astype(np.float64) for name in "xyz"])
    return points[np.isfinite(points).all(axis=1)]
