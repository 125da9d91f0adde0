"""ROS's own messages are moved by their registered functions and are still ROS's messages.

Scipy says where to.
"""

from collections.abc import Iterable
from typing import Any

import numpy as np
import pytest
from geometry_msgs.msg import (
    Point32,
    PointStamped,
    PolygonStamped,
    PoseStamped,
    PoseWithCovarianceStamped,
    Vector3Stamped,
)
from rclpy.duration import Duration
from rclpy.serialization import deserialize_message, serialize_message
from rclpy.time import Time
from scipy.spatial.transform import Rotation
from sensor_msgs.msg import PointCloud2, PointField

from tfcompose.foundation.geometry import Pose, normalise
from tfcompose.tf.tf2 import Buffer, TypeException

S = 1_000_000_000
QUAT = normalise((0.4, -0.1, 0.5, -0.7))
XYZ = (-2.0, 0.25, 11.0)
ROTATION = Rotation.from_quat(QUAT)
GIVEN = (0.5, -1.25, 2.0)


@pytest.fixture
def buffer() -> Buffer:
    """A laser that stands at XYZ, QUAT in base."""
    made = Buffer()
    for second in (1, 9):
        made.set("base", "laser", Pose(XYZ, QUAT), second * S, static=False)
    return made


def headed(kind: Any) -> Any:
    message = kind()
    message.header.frame_id, message.header.stamp = (
        "laser",
        Time(seconds=4, nanoseconds=5).to_msg(),
    )
    return message


def put(place: Any, values: Iterable[float]) -> None:
    for name, value in zip("xyzw", values, strict=False):
        setattr(place, name, value)


def of(place: Any, names: str = "xyz") -> list[float]:
    return [getattr(place, name) for name in names]


def moved(buffer: Buffer, message: Any) -> Any:
    """Return the moved message as it comes out of a publisher and into a subscription."""
    before = repr(message)
    transformed = buffer.transform(message, "base", timeout=Duration(seconds=0.1))
    assert repr(message) == before, "what was given is left alone"
    assert type(transformed) is type(message)
    assert (transformed.header.frame_id, transformed.header.stamp) == (
        "base",
        message.header.stamp,
    )
    return deserialize_message(serialize_message(transformed), type(message))


def test_points_vectors_and_corners(buffer: Buffer) -> None:
    point, vector, polygon = (
        headed(kind) for kind in (PointStamped, Vector3Stamped, PolygonStamped)
    )
    put(point.point, GIVEN)
    put(vector.vector, GIVEN)
    polygon.polygon.points = [Point32(x=0.5, y=-1.25, z=2.0), Point32()]
    assert of(moved(buffer, point).point) == pytest.approx(ROTATION.apply(GIVEN) + XYZ)
    assert of(moved(buffer, vector).vector) == pytest.approx(ROTATION.apply(GIVEN))
    first, second = moved(buffer, polygon).polygon.points
    assert of(first) == pytest.approx(ROTATION.apply(GIVEN) + XYZ, abs=1e-5)
    assert of(second) == pytest.approx(XYZ)


def test_poses_and_their_covariances(buffer: Buffer) -> None:
    rotation = Rotation.from_euler("xyz", (0.3, -0.2, 2.0))
    spread = np.random.default_rng(4).normal(size=(6, 6))
    covariance = spread @ spread.T
    pose, with_covariance = headed(PoseStamped), headed(PoseWithCovarianceStamped)
    with_covariance.pose.covariance = covariance.reshape(-1)
    for place in (pose.pose, with_covariance.pose.pose):
        put(place.position, GIVEN)
        put(place.orientation, rotation.as_quat())
    both = np.kron(np.eye(2), ROTATION.as_matrix())
    moved_pose = moved(buffer, with_covariance).pose
    assert np.array(moved_pose.covariance).reshape(6, 6) == pytest.approx(
        both @ covariance @ both.T
    )
    for each in (moved(buffer, pose).pose, moved_pose.pose):
        assert of(each.position) == pytest.approx(ROTATION.apply(GIVEN) + XYZ)
        assert (
            Rotation.from_quat(of(each.orientation, "xyzw")).inv() * ROTATION * rotation
        ).magnitude() < 1e-12


def test_an_organised_cloud_with_holes_and_colours(buffer: Buffer) -> None:
    kind = np.dtype(
        {
            "names": ["x", "y", "z", "rgb"],
            "formats": ["<f4", "<f4", "<f4", "<u4"],
            "offsets": [0, 4, 8, 16],
            "itemsize": 32,
        }
    )
    points = np.zeros((3, 5), kind)
    rng = np.random.default_rng(5)
    for name in "xyz":
        points[name] = rng.normal(size=(3, 5))
    points["rgb"] = rng.integers(1 << 32, size=(3, 5))
    points["x"][1, 2] = np.nan
    cloud = headed(PointCloud2)
    cloud.height, cloud.width, cloud.point_step, cloud.row_step = 3, 5, 32, 32 * 5 + 8
    columns: Any = kind.fields
    cloud.fields = [
        PointField(name=name, offset=columns[name][1], datatype=7, count=1)
        for name in ("x", "y", "z", "rgb")
    ]
    cloud.data = b"".join(row.tobytes() + b"gap here" for row in points)
    moved_cloud = moved(buffer, cloud)
    rows = bytes(moved_cloud.data)
    read = np.array([np.frombuffer(rows, kind, 5, row * cloud.row_step) for row in range(3)])
    expected = (
        ROTATION.apply(np.stack([points[n] for n in "xyz"], axis=-1).reshape(-1, 3).astype(float))
        + XYZ
    )
    assert np.stack([read[n] for n in "xyz"], axis=-1).reshape(-1, 3) == pytest.approx(
        expected, abs=1e-5, nan_ok=True
    )
    assert np.isnan(read["x"]).sum() == 1
    assert (read["rgb"] == points["rgb"]).all()
    assert [rows[row * cloud.row_step + 160 :][:8] for row in range(3)] == [b"gap here"] * 3
    assert (moved_cloud.fields, moved_cloud.row_step, moved_cloud.is_dense) == (
        cloud.fields,
        cloud.row_step,
        cloud.is_dense,
    )


def test_a_message_is_converted_to_another_type_only_if_meaningful(
    buffer: Buffer,
) -> None:
    point = headed(PointStamped)
    assert type(buffer.transform(point, "base", new_type=PointStamped)) is PointStamped
    with pytest.raises(TypeException, match=r"PointStamped .* PoseStamped"):
        buffer.transform(point, "base", new_type=PoseStamped)


def test_a_message_goes_to_another_time_through_a_frame_that_stands(buffer: Buffer) -> None:
    for second in (1, 9):
        buffer.set("odom", "base", Pose((float(second), 0.0, 0.0)), second * S, static=False)
    point = headed(PointStamped)
    moved_point = buffer.transform_full(point, "base", Time(seconds=6), "odom")
    assert of(moved_point.point) == pytest.approx([XYZ[0] - 2 + 5e-9, *XYZ[1:]])
    assert moved_point.header.stamp.sec == 6
