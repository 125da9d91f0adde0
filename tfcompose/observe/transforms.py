"""Messages moved to another frame: what tf2_geometry_msgs and tf2_sensor_msgs offer, by their names.

The result is a new message of the same type, in the frame and of the time of the transform; everything else in it is
the given message's.
"""

from __future__ import annotations

from copy import deepcopy
from importlib import import_module
from importlib.util import find_spec
from math import hypot
from typing import TYPE_CHECKING, Any

from tfcompose.geometry import matrix_from_quat
from tfcompose.observe.rotation import Seven, product, unit

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence


def do_transform_point(point: Any, transform: Any) -> Any:
    """Return a PointStamped in the transform's frame."""
    moved = _headed(point, transform)
    to = moved.point
    to.x, to.y, to.z = product(pose_of(transform), (to.x, to.y, to.z, 0.0, 0.0, 0.0, 1.0))[:3]
    return moved


def do_transform_vector3(vector: Any, transform: Any) -> Any:
    """Return a Vector3Stamped in the transform's frame: turned, and not moved."""
    moved = _headed(vector, transform)
    to, turn = moved.vector, (0.0, 0.0, 0.0, *pose_of(transform)[3:])
    to.x, to.y, to.z = product(turn, (to.x, to.y, to.z, 0.0, 0.0, 0.0, 1.0))[:3]
    return moved


def do_transform_pose(pose: Any, transform: Any) -> Any:
    """Return a Pose, which has no header, in the transform's frame; a quaternion of zeros counts as no rotation."""
    moved = deepcopy(pose)
    at, turn = moved.position, moved.orientation
    length = hypot(turn.x, turn.y, turn.z, turn.w)
    quat = tuple(part / length for part in (turn.x, turn.y, turn.z, turn.w)) if length else (0.0, 0.0, 0.0, 1.0)
    given = (at.x, at.y, at.z, quat[0], quat[1], quat[2], quat[3])
    at.x, at.y, at.z, turn.x, turn.y, turn.z, turn.w = unit(product(pose_of(transform), given))
    return moved


def do_transform_pose_stamped(pose: Any, transform: Any) -> Any:
    """Return a PoseStamped in the transform's frame."""
    moved = _headed(pose, transform)
    moved.pose = do_transform_pose(pose.pose, transform)
    return moved


def do_transform_pose_with_covariance_stamped(pose: Any, transform: Any) -> Any:
    """Return a PoseWithCovarianceStamped in the transform's frame; the covariances' axes are turned along."""
    moved = _headed(pose, transform)
    moved.pose.pose = do_transform_pose(pose.pose.pose, transform)
    moved.pose.covariance = transform_covariance(pose.pose.covariance, transform)
    return moved


def transform_covariance(covariance: Sequence[float], transform: Any) -> list[float]:
    """Return a 6×6 covariance (x y z and the three rotations; 36 numbers by rows) with its axes turned: R·C·Rᵀ.

    Each of its four 3×3 blocks is turned by itself.
    """
    _, _, _, x, y, z, w = pose_of(transform)
    turn = matrix_from_quat((x, y, z, w))
    moved = [0.0] * 36
    for top in (0, 3):
        for left in (0, 3):
            block = [[float(covariance[6 * (top + i) + left + j]) for j in range(3)] for i in range(3)]
            for i in range(3):
                for j in range(3):
                    moved[6 * (top + i) + left + j] = sum(
                        turn[i][k] * block[k][m] * turn[j][m] for k in range(3) for m in range(3)
                    )
    return moved


def do_transform_polygon_stamped(polygon: Any, transform: Any) -> Any:
    """Return a PolygonStamped in the transform's frame."""
    moved, pose = _headed(polygon, transform), pose_of(transform)
    for corner in moved.polygon.points:
        corner.x, corner.y, corner.z = product(pose, (corner.x, corner.y, corner.z, 0.0, 0.0, 0.0, 1.0))[:3]
    return moved


def do_transform_cloud(cloud: Any, transform: Any) -> Any:
    """Return a PointCloud2 in the transform's frame: x, y and z are moved, every other byte is as it was.

    The fields may have any order, offsets, padding and byte order, and be float32 or float64; the cloud may be
    organised and hold NaN. The time stays the cloud's. Needs numpy.

    Raises:
        InvalidArgumentException: if there is no x, y or z of such a type, or less data than the cloud claims to have.
    """
    moved = arrays("cloud").moved_cloud(cloud, pose_of(transform))
    moved.header.frame_id = getattr(transform, "header", cloud.header).frame_id
    return moved


#: What ``Buffer.transform`` does with a message, by the name of its type; ``registration`` takes others.
TRANSFORMS: dict[str, Callable[[Any, Any], Any]] = {
    "PointStamped": do_transform_point,
    "Vector3Stamped": do_transform_vector3,
    "PoseStamped": do_transform_pose_stamped,
    "PoseWithCovarianceStamped": do_transform_pose_with_covariance_stamped,
    "PolygonStamped": do_transform_polygon_stamped,
    "PointCloud2": do_transform_cloud,
}


def arrays(module: str) -> Any:
    """Return a module of this package that needs numpy.

    Raises:
        ImportError: if there is no numpy; it says what to install.
    """
    if find_spec("numpy") is None:
        raise ImportError("many points or poses at once need numpy: pip install 'tfcompose[arrays]'")
    return import_module(f"tfcompose.observe.{module}")


def pose_of(transform: Any) -> Seven:
    """Return the pose of a TransformStamped, or of a Transform, as numbers; its quaternion is brought to length 1."""
    inner = getattr(transform, "transform", transform)
    to, turn = inner.translation, inner.rotation
    return unit((to.x, to.y, to.z, turn.x, turn.y, turn.z, turn.w))


def _headed(message: Any, transform: Any) -> Any:
    """Return a copy of the message with the frame and the time of the transform."""
    copied = deepcopy(message)
    copied.header.frame_id = transform.header.frame_id
    copied.header.stamp.sec, copied.header.stamp.nanosec = transform.header.stamp.sec, transform.header.stamp.nanosec
    return copied
