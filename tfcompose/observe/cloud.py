"""A PointCloud2 moved to another frame, whatever its layout; needs numpy."""

from __future__ import annotations

from array import array
from copy import copy, deepcopy
from typing import TYPE_CHECKING, Any

import numpy as np

from tfcompose.observe.exceptions import InvalidArgumentException
from tfcompose.observe.points import turn_and_shift

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tfcompose.observe.rotation import Seven

# sensor_msgs/PointField: FLOAT32 and FLOAT64.
_TYPES = {7: "f4", 8: "f8"}
_BLOCK = 1 << 13


def moved_cloud(cloud: Any, pose: Seven) -> Any:
    """Return a copy of the cloud with x, y and z moved; its header is a copy of the cloud's.

    Raises:
        InvalidArgumentException: if there is no x, y or z of type float32 or float64, or too little data.
    """
    given = cloud.data if isinstance(cloud.data, (array, bytes, bytearray, memoryview)) else bytes(cloud.data)
    data = np.frombuffer(given, np.uint8).copy()
    columns = [_column(cloud, name, data) for name in "xyz"]
    turned, to = turn_and_shift(pose)
    for row in range(cloud.height):
        for start in range(0, cloud.width, _BLOCK):
            block = slice(start, start + _BLOCK)
            points = np.stack([column[row, block] for column in columns], axis=1, dtype=np.float64)
            points = points @ turned + to
            for index, column in enumerate(columns):
                column[row, block] = points[:, index]
    moved = copy(cloud)
    moved.header = deepcopy(cloud.header)
    moved.data = array("B")
    moved.data.frombytes(data.data)
    return moved


def _column(cloud: Any, name: str, data: NDArray[np.uint8]) -> NDArray[Any]:
    """Return the values of a field as an array of height × width that lies in ``data``."""
    field = next((each for each in cloud.fields if each.name == name), None)
    if field is None:
        there = ", ".join(each.name for each in cloud.fields) or "none"
        raise InvalidArgumentException(f"the cloud has no field {name}; its fields are: {there}")
    if field.datatype not in _TYPES:
        raise InvalidArgumentException(
            f"the cloud's {name} is of type {field.datatype}, not float32 (7) or float64 (8)"
        )
    kind = np.dtype((">" if cloud.is_bigendian else "<") + _TYPES[field.datatype])
    rows = [cloud.row_step] * (cloud.height > 1)
    if field.offset + kind.itemsize > cloud.point_step or any(cloud.width * cloud.point_step > row for row in rows):
        raise InvalidArgumentException(
            f"the cloud's steps do not fit: {name} ends at byte {field.offset + kind.itemsize} of a point, a point has "
            f"{cloud.point_step} bytes, a row has {cloud.width} points and {cloud.row_step} bytes"
        )
    size = sum(rows) * (cloud.height - 1) + cloud.width * cloud.point_step
    if cloud.height and size > len(data):
        wanted = f"{cloud.height} × {cloud.width} points need {size}"
        raise InvalidArgumentException(f"the cloud has {len(data)} bytes, and {wanted}")
    shape = (cloud.height, cloud.width) if cloud.height and cloud.width else (0, 0)
    strides = (cloud.row_step, cloud.point_step)
    column: NDArray[Any] = np.ndarray(shape, kind, data.data, field.offset if shape[0] else 0, strides)
    return column
