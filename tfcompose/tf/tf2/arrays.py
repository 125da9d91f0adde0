"""Many poses and points at once: trajectories, arrays of points and PointCloud2.

This module requires numpy.
"""

from __future__ import annotations

from array import array
from copy import copy
from math import factorial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from tfcompose.foundation.geometry import matrix_from_quat
from tfcompose.tf.tf2.exceptions import (
    ExtrapolationException,
    InvalidArgumentException,
    TransformException,
)
from tfcompose.tf.tf2.poses import IDENTITY, PoseTuple, inverse, inverse_product, product

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from tfcompose.tf.tf2.cache import PoseChain, TimeCache
    from tfcompose.tf.tf2.pose_buffer import PoseBuffer

    Floats = NDArray[np.float64]
    Stamps = NDArray[np.int64]

# Number of times per block, which limits the size of temporary arrays.
_BLOCK = 1 << 14
_ARRAYS = 64
# Number of points per block, so that a block fits into the CPU's cache.
_POINTS = 1 << 13
# Angle in radians up to which sine and cosine are computed as series, to x¹³ and x¹².
_SMALL = 0.4
_SINE = [(-1) ** k / factorial(2 * k + 1) for k in range(6, -1, -1)]
_COSINE = [(-1) ** k / factorial(2 * k) for k in range(6, -1, -1)]
# sensor_msgs/PointField: FLOAT32 and FLOAT64.
_FIELD_TYPES = {7: "f4", 8: "f8"}


class Trajectory(NamedTuple):
    """N poses of a frame in another frame."""

    #: N×3, in metres.
    xyz: Floats
    #: N×4, unit quaternions with w ≥ 0.
    quat_xyzw: Floats

    def matrices(self) -> Floats:
        """Return the poses as homogeneous matrices, N×4×4.

        They map coordinates in the source to coordinates in the target.
        """
        x, y, z, w = self.quat_xyzw.T
        made = np.zeros((len(self.xyz), 4, 4))
        made[:, 0, 0], made[:, 0, 1], made[:, 0, 2] = (
            1 - 2 * (y * y + z * z),
            2 * (x * y - z * w),
            2 * (x * z + y * w),
        )
        made[:, 1, 0], made[:, 1, 1], made[:, 1, 2] = (
            2 * (x * y + z * w),
            1 - 2 * (x * x + z * z),
            2 * (y * z - x * w),
        )
        made[:, 2, 0], made[:, 2, 1], made[:, 2, 2] = (
            2 * (x * z - y * w),
            2 * (y * z + x * w),
            1 - 2 * (x * x + y * y),
        )
        made[:, :3, 3], made[:, 3, 3] = self.xyz, 1.0
        return made


def stamps_of(stamps: ArrayLike) -> Stamps:
    """Return times in nanoseconds as an array of int64.

    Raises:
        TypeError: if they are not integers in a one-dimensional array.
    """
    array = np.asarray(stamps)
    if array.ndim != 1 or (array.dtype.kind not in "iu" and array.size):
        raise TypeError(
            f"stamps are one row of whole nanoseconds, not {array.dtype} of shape {array.shape}"
        )
    return array.astype(np.int64)


def lookup_many(
    buffer: PoseBuffer, target: str, source: str, stamps: ArrayLike, outside: str
) -> Trajectory:
    """Return the result of ``Buffer.lookup_many``."""
    times = stamps_of(stamps)
    with buffer.lock():
        if not times.all():
            times = np.where(times == 0, buffer.lookup(target, source)[1], times)
        chain = buffer.chain_for_all_times(target, source)
        trajectory, is_known = (
            _at_once(chain, times) if chain else _one_by_one(buffer, target, source, times)
        )
        if outside == "raise" and not is_known.all():
            first = int(times[np.argmin(is_known)])
            reason = buffer.can_lookup(target, source, first)
            raise ExtrapolationException(
                f"{reason}; so it is for {np.count_nonzero(~is_known)} of {len(times)} times"
            )
    trajectory.xyz[~is_known], trajectory.quat_xyzw[~is_known] = np.nan, np.nan
    return trajectory


def _one_by_one(
    buffer: PoseBuffer, target: str, source: str, stamps: Stamps
) -> tuple[Trajectory, NDArray[np.bool_]]:
    """Return the poses if parents change over time, with a separate chain for each time."""
    is_known = np.ones(len(stamps), bool)
    trajectory = Trajectory(np.zeros((len(stamps), 3)), np.zeros((len(stamps), 4)))
    for index, stamp_ns in enumerate(stamps.tolist()):
        try:
            pose, _ = buffer.lookup(target, source, stamp_ns)
        except TransformException:
            is_known[index] = False
        else:
            trajectory.xyz[index], trajectory.quat_xyzw[index] = pose.xyz, pose.quat_xyzw
    return trajectory, is_known


def _at_once(chain: PoseChain, stamps: Stamps) -> tuple[Trajectory, NDArray[np.bool_]]:
    """Return the poses at these times, and a mask of the times at which all edges have a pose.

    The poses at other times are undefined.
    """
    is_known = np.ones(len(stamps), bool)
    trajectory = Trajectory(np.empty((len(stamps), 3)), np.empty((len(stamps), 4)))
    order = None if (stamps[1:] >= stamps[:-1]).all() else np.argsort(stamps, kind="stable")
    for start in range(0, len(stamps), _BLOCK):
        block: Any = (
            slice(start, start + _BLOCK) if order is None else order[start : start + _BLOCK]
        )
        times = stamps[block]
        _keep_memory(len(times))
        some = np.ones(len(times), bool)
        pose = _along(chain, times, some)
        is_known[block] = some
        trajectory.xyz[block], trajectory.quat_xyzw[block] = _of_unit_length(pose, len(times))
    return trajectory, is_known


def _keep_memory(count: int) -> None:
    """Free an array of the size that a block needs, without touching it.

    After that, the C library (glibc) keeps this much memory between the steps. Otherwise it would
    return the memory to the system and get it again page by page, which took longer than the
    arithmetic.
    """
    np.empty((_ARRAYS, count))


def _along(chain: PoseChain, stamps: Stamps, is_known: NDArray[np.bool_]) -> tuple[Any, ...]:
    """Return the chain's poses at ascending times. Clear ``is_known`` where an edge has none."""
    pose: Any = None
    for cache, fixed, backwards in chain.links:
        link: Any = fixed if cache is None else _poses(cache, stamps, is_known)
        if pose is None:
            pose = inverse(link) if backwards else link
        else:
            pose = inverse_product(link, pose) if backwards else product(link, pose)
    return pose or IDENTITY


def _of_unit_length(pose: tuple[Any, ...], count: int) -> Trajectory:
    xyz, quat = np.empty((count, 3)), np.empty((count, 4))
    qx, qy, qz, qw = pose[3:]
    scale = np.copysign(1 / np.sqrt(qx * qx + qy * qy + qz * qz + qw * qw), qw)
    for column, part in zip(xyz.T, pose[:3], strict=True):
        column[:] = part
    for column, part in zip(quat.T, pose[3:], strict=True):
        np.multiply(part, scale, out=column)
    return Trajectory(xyz, quat)


def _poses(cache: TimeCache, stamps: Stamps, is_known: NDArray[np.bool_]) -> tuple[Floats, ...]:
    """Return the edge's poses at ascending times as seven arrays.

    ``is_known`` is cleared where there is no pose.
    """
    count = len(cache)
    stamps_ns = np.array(cache.stamps)[-count:]
    samples = np.array(cache.poses)[-7 * count :].reshape(count, 7).T.copy()
    is_known[: np.searchsorted(stamps, stamps_ns[0])] = False
    is_known[np.searchsorted(stamps, stamps_ns[-1], "right") :] = False
    if count == 1:
        return tuple(samples)
    # Each interval goes from a sample to the next. A time equal to a sample's time belongs to the
    # interval after it, with the last sample of that time. The first time of all belongs to the
    # first sample, and the last time to the last.
    begins = np.searchsorted(stamps, stamps_ns[1:-1])
    if stamps_ns[0] == stamps_ns[1]:
        begins[: np.searchsorted(stamps_ns[1:-1], stamps_ns[0], "right")] = np.searchsorted(
            stamps, stamps_ns[0], "right"
        )
    times = np.diff(begins, prepend=0, append=len(stamps))  # number of times in each interval
    since = (stamps - stamps_ns[0]).astype(np.float64)
    rows = np.repeat(_stretches(stamps_ns, samples), times, axis=1)
    x, y, z, dx, dy, dz, ax, ay, az, aw, bx, by, bz, bw, angle, start, per_ns = rows
    part = (since - start) * per_ns
    sine, cosine = _sine_cosine(part * angle)
    return (
        x + dx * part,
        y + dy * part,
        z + dz * part,
        ax * cosine + bx * sine,
        ay * cosine + by * sine,
        az * cosine + bz * sine,
        aw * cosine + bw * sine,
    )


def _stretches(stamps: Stamps, samples: Floats) -> Floats:
    """Return 17 rows with a column for each interval between samples.

    The rows are the position at the start, the displacement to the end, the quaternion at the
    start, the orthogonal quaternion towards which it rotates the short way, the angle, the
    nanoseconds since the first sample, and the inverse of the interval's length.
    """
    begin, end = samples[:, :-1], samples[:, 1:]
    dot = (begin[3:] * end[3:]).sum(axis=0)
    to = np.where(dot < 0, -end[3:], end[3:]) - begin[3:] * np.abs(dot)
    sine = np.sqrt((to * to).sum(axis=0))
    to /= np.where(sine == 0, 1.0, sine)
    steps = np.diff(stamps)
    per_ns = 1 / np.where(steps == 0, np.inf, steps)
    rest = np.stack(
        [np.arctan2(sine, np.abs(dot)), (stamps[:-1] - stamps[0]).astype(np.float64), per_ns]
    )
    rows = np.concatenate([begin[:3], end[:3] - begin[:3], begin[3:], to, rest])
    if steps[-1] == 0:  # of two newest samples with the same time, the last counts
        rows[:3, -1], rows[6:10, -1] = samples[:3, -1], samples[3:, -1]
    return rows


def _sine_cosine(angles: Floats) -> tuple[Floats, Floats]:
    """Return sine and cosine; for small angles by a series that is three times faster.

    The first omitted term is below the rounding error of a double.
    """
    if len(angles) == 0 or max(angles.max(), -angles.min()) > _SMALL:
        return np.sin(angles), np.cos(angles)
    squared = angles * angles
    sine, cosine = _SINE[0], _COSINE[0]
    for p, q in zip(_SINE[1:], _COSINE[1:], strict=True):
        sine, cosine = sine * squared + p, cosine * squared + q
    return sine * angles, cosine


def transform_points_array(points: ArrayLike, pose: PoseTuple) -> NDArray[Any]:
    """Return points in the parent's frame from points in the child's frame.

    ``points`` and the result have the shape (…, 3), in metres. float32 and float64 keep their
    type, and other numbers become float64. The computation uses float64. NaN stays NaN.

    Raises:
        InvalidArgumentException: if the last dimension is not 3.
    """
    array = np.asarray(points)
    if array.ndim == 0 or array.shape[-1] != 3:  # noqa: PLR2004 (x, y, z)
        raise InvalidArgumentException(f"points have the shape (…, 3), not {array.shape}")
    moved = np.empty(
        array.shape, array.dtype if array.dtype in (np.float32, np.float64) else np.float64
    )
    turned, to = rotation_and_translation(pose)
    rows, out = array.reshape(-1, 3), moved.reshape(-1, 3)
    for start in range(0, len(rows), _POINTS):
        block = slice(start, start + _POINTS)
        out[block] = rows[block].astype(np.float64, copy=False) @ turned + to
    return moved


def rotation_and_translation(pose: PoseTuple) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the matrix (3×3) and the vector that transform rows of points.

    The result is ``rows @ matrix + vector``.
    """
    x, y, z, qx, qy, qz, qw = pose
    return np.array(matrix_from_quat((qx, qy, qz, qw))).T.copy(), np.array((x, y, z))


def transform_cloud(cloud: Any, pose: PoseTuple) -> Any:
    """Return a copy of the cloud with x, y and z transformed; its header is unchanged.

    Raises:
        InvalidArgumentException: if there is no x, y or z of type float32 or float64, or too
            little data.
    """
    raw = (
        cloud.data
        if isinstance(cloud.data, (array, bytes, bytearray, memoryview))
        else bytes(cloud.data)
    )
    data = np.frombuffer(raw, np.uint8).copy()
    columns = [_column(cloud, name, data) for name in "xyz"]
    turned, to = rotation_and_translation(pose)
    for row in range(cloud.height):
        for start in range(0, cloud.width, _POINTS):
            block = slice(start, start + _POINTS)
            points = np.stack([column[row, block] for column in columns], axis=1, dtype=np.float64)
            points = points @ turned + to
            for index, column in enumerate(columns):
                column[row, block] = points[:, index]
    moved = copy(cloud)
    moved.data = array("B")
    moved.data.frombytes(data.data)
    return moved


def _column(cloud: Any, name: str, data: NDArray[np.uint8]) -> NDArray[Any]:
    """Return the values of a field as an array of height × width, a view of ``data``."""
    field = next((each for each in cloud.fields if each.name == name), None)
    if field is None:
        field_names = ", ".join(each.name for each in cloud.fields) or "none"
        raise InvalidArgumentException(
            f"the cloud has no field {name}; its fields are: {field_names}"
        )
    if field.datatype not in _FIELD_TYPES:
        raise InvalidArgumentException(
            f"the cloud's {name} is of type {field.datatype}, not float32 (7) or float64 (8)"
        )
    kind = np.dtype((">" if cloud.is_bigendian else "<") + _FIELD_TYPES[field.datatype])
    rows = [cloud.row_step] * (cloud.height > 1)
    if field.offset + kind.itemsize > cloud.point_step or any(
        cloud.width * cloud.point_step > row for row in rows
    ):
        raise InvalidArgumentException(
            f"the cloud's steps do not fit: {name} ends at byte {field.offset + kind.itemsize} of"
            f" a point, a point has {cloud.point_step} bytes, a row has {cloud.width} points and"
            f" {cloud.row_step} bytes"
        )
    size = sum(rows) * (cloud.height - 1) + cloud.width * cloud.point_step
    if cloud.height and size > len(data):
        need = f"{cloud.height} × {cloud.width} points need {size}"
        raise InvalidArgumentException(f"the cloud has {len(data)} bytes, and {need}")
    shape = (cloud.height, cloud.width) if cloud.height and cloud.width else (0, 0)
    strides = (cloud.row_step, cloud.point_step)
    column: NDArray[Any] = np.ndarray(
        shape, kind, data.data, field.offset if shape[0] else 0, strides
    )
    return column
