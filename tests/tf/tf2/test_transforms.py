"""Points, vectors, poses and clouds are moved.

Scipy and numpy's structured arrays say where to.
"""

import random
import struct
from array import array
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tfcompose.foundation.geometry import Pose, normalise, quat_from_rpy
from tfcompose.tf.tf2 import Buffer, InvalidArgumentException
from tfcompose.tf.tf2.exceptions import TypeException
from tfcompose.tf.tf2.messages import (
    Header,
    Quaternion,
    Time,
    Vector3,
    do_transform_cloud,
    transform_covariance,
)

S = 1_000_000_000
QUAT = normalise((0.1, -0.7, 0.3, 0.6))
XYZ = (1.0, 2.0, -3.0)
ROTATION = Rotation.from_quat(QUAT)


def laser() -> Buffer:
    """A laser that stands at XYZ, QUAT in base from 0 s to 9 s."""
    buffer = Buffer()
    for second in (1, 9):
        buffer.set("base", "laser", Pose(XYZ, QUAT), second * S, static=False)
    return buffer


# Stand-ins with the names and the fields of ROS's messages.
@dataclass
class PointStamped:
    header: Header
    point: Vector3


@dataclass
class Vector3Stamped:
    header: Header
    vector: Vector3


@dataclass
class Placed:
    position: Vector3
    orientation: Quaternion


@dataclass
class PoseStamped:
    header: Header
    pose: Placed


@dataclass
class Known:
    pose: Placed
    covariance: list[float]


@dataclass
class PoseWithCovarianceStamped:
    header: Header
    pose: Known


@dataclass
class Polygon:
    points: list[Vector3]


@dataclass
class PolygonStamped:
    header: Header
    polygon: Polygon


@dataclass
class PointField:
    name: str
    offset: int
    datatype: int
    count: int = 1


@dataclass
class PointCloud2:
    header: Header
    height: int
    width: int
    fields: list[PointField]
    is_bigendian: bool
    point_step: int
    row_step: int
    data: Any
    is_dense: bool = True


def header(frame: str = "laser", sec: int = 5) -> Header:
    return Header(Time(sec, 7), frame)


def test_a_point_is_turned_and_moved_and_gets_the_frame_and_the_time() -> None:
    original = PointStamped(header(), Vector3(0.5, -1.0, 2.0))
    moved = laser().transform(original, "base")
    assert (moved.point.x, moved.point.y, moved.point.z) == pytest.approx(
        tuple(ROTATION.apply([0.5, -1, 2]) + XYZ)
    )
    assert moved.header == Header(Time(5, 7), "base")
    assert original == PointStamped(header(), Vector3(0.5, -1.0, 2.0)), (
        "the argument is left alone"
    )
    newest = laser().transform(PointStamped(Header(Time(), "laser"), Vector3()), "base")
    assert newest.header.stamp == Time(9, 0)


def test_a_vector_is_turned_and_not_moved() -> None:
    moved = laser().transform(Vector3Stamped(header(), Vector3(0.5, -1.0, 2.0)), "base")
    assert (moved.vector.x, moved.vector.y, moved.vector.z) == pytest.approx(
        tuple(ROTATION.apply([0.5, -1, 2]))
    )


def test_every_corner_of_a_polygon_is_moved() -> None:
    corners = [(0.5, -1.0, 2.0), (0.0, 0.0, 0.0), (3.0, 4.0, 5.0)]
    original = PolygonStamped(header(), Polygon([Vector3(*corner) for corner in corners]))
    moved = laser().transform(original, "base")
    points = [(corner.x, corner.y, corner.z) for corner in moved.polygon.points]
    assert points == pytest.approx(ROTATION.apply(corners) + XYZ)
    assert (original.polygon.points[0].x, moved.header.frame_id) == (0.5, "base")


@pytest.mark.parametrize(
    "quat", [(0.5, 0.5, 0.5, 0.5), (0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 2.0)]
)
def test_a_pose_is_the_product_of_poses(quat: tuple[float, float, float, float]) -> None:
    moved = (
        laser()
        .transform(PoseStamped(header(), Placed(Vector3(1, 2, 3), Quaternion(*quat))), "base")
        .pose
    )
    position, rotation = moved.position, moved.orientation
    assert (position.x, position.y, position.z) == pytest.approx(
        tuple(ROTATION.apply([1, 2, 3]) + XYZ)
    )
    expected = ROTATION * (Rotation.from_quat(quat) if any(quat) else Rotation.identity())
    assert (
        Rotation.from_quat([rotation.x, rotation.y, rotation.z, rotation.w]).inv() * expected
    ).magnitude() < 1e-12


def test_covariances_are_turned_with_both_sides() -> None:
    rng = np.random.default_rng(3)
    spread = rng.normal(size=(6, 6))
    covariance = spread @ spread.T
    original = PoseWithCovarianceStamped(
        header(), Known(Placed(Vector3(), Quaternion()), covariance.reshape(-1).tolist())
    )
    moved = laser().transform(original, "base")
    both = np.kron(np.eye(2), ROTATION.as_matrix())
    assert np.array(moved.pose.covariance).reshape(6, 6) == pytest.approx(
        both @ covariance @ both.T
    )
    transform = laser().lookup_transform("base", "laser", 0)
    assert transform_covariance([0.0] * 36, transform) == [0.0] * 36


def test_between_two_times_a_point_is_moved_through_the_fixed_frame() -> None:
    buffer = Buffer()
    for second in range(1, 9):
        buffer.set("odom", "base", Pose((float(second), 0, 0)), second * S, static=False)
    original = PointStamped(Header(Time(2), "base"), Vector3(1.0))
    moved = buffer.transform_full(original, "base", Time(6), "odom")
    assert (moved.point.x, moved.header.stamp) == (-3.0, Time(6))


def test_a_type_that_is_not_known_is_named() -> None:
    with pytest.raises(TypeException, match=r"Header\b.*\bPointStamped"):
        laser().transform(Header(), "base")


@pytest.mark.parametrize("kind", [np.float32, np.float64])
@pytest.mark.parametrize("shape", [(0, 3), (1, 3), (20_000, 3), (4, 5, 3)])
def test_points_are_moved_in_any_shape_and_keep_their_type(
    kind: Any, shape: tuple[int, ...]
) -> None:
    points = np.random.default_rng(1).normal(size=shape).astype(kind)
    moved = laser().transform_points(points, "base", "laser", 5 * S)
    assert (moved.shape, moved.dtype) == (shape, kind)
    assert moved.reshape(-1, 3) == pytest.approx(
        ROTATION.apply(points.reshape(-1, 3)) + XYZ, abs=1e-5
    )


def test_points_that_are_strided_complete_numbers_or_nan_are_taken() -> None:
    buffer = laser()
    grid = np.arange(60).reshape(10, 6)
    assert buffer.transform_points(grid[::2, ::2], "base", "laser") == pytest.approx(
        ROTATION.apply(grid[::2, ::2]) + XYZ
    )
    holes = buffer.transform_points(np.array([[np.nan, 0, 0], [1, 2, 3]]), "base", "laser")
    assert np.isnan(holes[:, 0]).tolist() == [True, False]
    wrongs: tuple[Any, ...] = ([1.0, 2.0], np.zeros((3, 4)), 1.0)
    for wrong in wrongs:
        with pytest.raises(InvalidArgumentException, match="points have the shape"):
            buffer.transform_points(wrong, "base", "laser")


SIZES = {1: 1, 2: 1, 3: 2, 4: 2, 5: 4, 6: 4, 7: 4, 8: 8}


@dataclass
class Layout:
    """A random way to lay a cloud out: order, gaps, types, rows."""

    rng: random.Random
    fields: list[PointField] = field(default_factory=list)

    def __post_init__(self) -> None:
        kinds = [
            ("x", self.rng.choice([7, 8])),
            ("y", self.rng.choice([7, 8])),
            ("z", self.rng.choice([7, 8])),
        ]
        kinds += [
            (name, self.rng.choice(list(SIZES)))
            for name in ("intensity", "ring", "rgb")[: self.rng.randrange(4)]
        ]
        self.rng.shuffle(kinds)
        offset = self.rng.randrange(5)
        for name, datatype in kinds:
            self.fields.append(PointField(name, offset, datatype))
            offset += SIZES[datatype] + self.rng.choice([0, 0, 3, 4])
        self.point_step = offset + self.rng.randrange(9)
        self.height, self.width = self.rng.choice([(1, 7), (3, 5), (4, 1), (1, 0), (0, 0)])
        self.row_step = self.width * self.point_step + (
            self.rng.randrange(9) if self.height > 1 else 0
        )
        self.bigendian = self.rng.random() < 0.5

    def cloud(self) -> PointCloud2:
        data = bytearray(self.rng.randbytes(self.row_step * self.height))
        for _, offset, code in self.places():
            value = float("nan") if self.rng.random() < 0.1 else self.rng.uniform(-9, 9)
            struct.pack_into(code, data, offset, value)
        names = [
            PointField(each.name, each.offset, each.datatype, each.count) for each in self.fields
        ]
        return PointCloud2(
            header(),
            self.height,
            self.width,
            names,
            self.bigendian,
            self.point_step,
            self.row_step,
            data,
            False,  # noqa: FBT003
        )

    def places(self) -> list[tuple[str, int, str]]:
        """Return name, byte and struct format of every coordinate."""
        order = ">" if self.bigendian else "<"
        return [
            (
                each.name,
                row * self.row_step + column * self.point_step + each.offset,
                order + " fd"[each.datatype - 6],
            )
            for row in range(self.height)
            for column in range(self.width)
            for each in sorted(self.fields, key=lambda each: each.name)
            if each.name in "xyz"
        ]


@pytest.mark.parametrize("seed", range(40))
def test_a_cloud_of_any_layout_is_moved_and_every_other_byte_stays(seed: int) -> None:
    layout = Layout(random.Random(seed))
    original = layout.cloud()
    before = bytes(original.data)
    moved = laser().transform(original, "base")
    assert bytes(original.data) == before
    assert isinstance(moved.data, array)
    after = bytes(moved.data)
    assert len(after) == len(before)
    coordinates: set[int] = set()
    places = layout.places()
    for x, y, z in zip(places[::3], places[1::3], places[2::3], strict=True):
        point = [struct.unpack_from(code, before, offset)[0] for _, offset, code in (x, y, z)]
        moved_point = [struct.unpack_from(code, after, offset)[0] for _, offset, code in (x, y, z)]
        assert moved_point == pytest.approx(
            (ROTATION.apply([point]) + XYZ)[0], abs=1e-5, nan_ok=True
        )
        coordinates |= {
            offset + i for _, offset, code in (x, y, z) for i in range(struct.calcsize(code))
        }
    assert all(
        a == b for i, (a, b) in enumerate(zip(before, after, strict=True)) if i not in coordinates
    )
    assert moved.header == Header(Time(5, 7), "base")
    same = ("height", "width", "fields", "is_bigendian", "point_step", "row_step", "is_dense")
    assert all(getattr(moved, name) == getattr(original, name) for name in same)


def xyz_cloud(**changes: Any) -> PointCloud2:
    fields = [PointField(name, 4 * index, 7) for index, name in enumerate("xyz")]
    original: dict[str, Any] = {
        "height": 1,
        "width": 2,
        "point_step": 12,
        "row_step": 24,
        "data": bytes(24),
    }
    original |= {"fields": fields, "is_bigendian": False} | changes
    return PointCloud2(header(), **original)


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"fields": []}, r"\bx\b"),
        (
            {"fields": [PointField("x", 0, 7), PointField("y", 4, 7), PointField("i", 8, 7)]},
            r"\bz\b.*x, y, i",
        ),
        ({"fields": [PointField(name, 0, 5) for name in "xyz"]}, r"\bx\b.*\b5\b.*float32"),
        ({"data": bytes(23)}, r" 23 bytes.* 24"),
        ({"width": 4_000_000_000}, "need 48000000000"),
        ({"width": 4_000_000_000, "point_step": 0}, "steps do not fit"),
        ({"point_step": 8}, r"\bz\b.* 12 .* 8 bytes"),
        ({"height": 2, "row_step": 12}, " 2 points .*12 bytes"),
        ({"height": 4_000_000_000}, "steps do not fit|need"),
    ],
)
def test_a_cloud_that_is_not_what_it_claims_is_refused(changes: dict[str, Any], why: str) -> None:
    with pytest.raises(InvalidArgumentException, match=why):
        laser().transform(xyz_cloud(**changes), "base")


def test_a_flat_cloud_may_omit_its_row_step_and_its_data_may_be_a_list() -> None:
    data = list(struct.pack("<6f", 1, 2, 3, 4, 5, 6))
    transform = laser().lookup_transform("base", "laser", 0)
    moved = do_transform_cloud(xyz_cloud(row_step=0, data=data), transform)
    assert np.frombuffer(moved.data, "<f4").reshape(2, 3) == pytest.approx(
        ROTATION.apply([[1, 2, 3], [4, 5, 6]]) + XYZ, abs=1e-5
    )


def test_a_level_camera_sees_forward() -> None:
    """REP-103: an optical frame's z is the body's x."""
    buffer = Buffer()
    buffer.set(
        "base",
        "optical",
        Pose((0, 0, 1), quat_from_rpy(-np.pi / 2, 0, -np.pi / 2)),
        0,
        static=True,
    )
    assert buffer.transform_points([[0.0, 0.0, 5.0]], "base", "optical")[0] == pytest.approx(
        [5, 0, 1]
    )
