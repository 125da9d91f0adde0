"""Messages of a buffer: times, TransformStamped, and transforms of other messages.

A program that has loaded ROS's geometry_msgs gets ROS's ``TransformStamped``, which it can
publish. Any other program gets the classes of this module, which have the same fields. A time is
an object with ``nanoseconds`` (rclpy's ``Time`` and ``Duration``) or with ``sec`` and ``nanosec``
(the messages), or an int of nanoseconds.

The ``do_transform_…`` functions are those of tf2_geometry_msgs and tf2_sensor_msgs. Each returns a
new message of the same type, with the frame and the stamp of the transform. Everything else is
copied from the given message. ``TransformRegistration`` and ``ConvertRegistration`` are tf2_ros's.
A package registers its own types there as with tf2_ros, for the entire program.
"""

from __future__ import annotations

import sys
from copy import deepcopy
from dataclasses import dataclass, field
from importlib.util import find_spec
from math import hypot
from typing import TYPE_CHECKING, Any, ClassVar

from tfcompose.foundation.geometry import matrix_from_quat
from tfcompose.tf.tf2.exceptions import TypeException
from tfcompose.tf.tf2.poses import IDENTITY, PoseTuple, product, unit

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import ArrayLike, NDArray

    Maker = Callable[[str, str, int, PoseTuple], Any]
    #: Transforms an object by a TransformStamped.
    Move = Callable[[Any, Any], Any]
    Conversion = Callable[[Any], Any]

_SECOND_NS = 1_000_000_000


def complete_rclpy() -> None:
    """Load rclpy's times if rclpy is loaded.

    tf2_ros imports them, so programs use ``rclpy.time.Time`` after only ``import rclpy``.
    """
    if sys.modules.get("rclpy"):
        import tfcompose.tf.ros.rclpy_times  # noqa: F401, PLC0415 (ROS is optional)


@dataclass(slots=True)
class Time:
    """builtin_interfaces/Time."""

    sec: int = 0
    nanosec: int = 0

    @property
    def nanoseconds(self) -> int:
        """The time in nanoseconds, as in rclpy's ``Time``."""
        return self.sec * _SECOND_NS + self.nanosec


@dataclass(slots=True)
class Header:
    """std_msgs/Header."""

    stamp: Time = field(default_factory=Time)
    frame_id: str = ""


@dataclass(slots=True)
class Vector3:
    """geometry_msgs/Vector3: metres."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0


@dataclass(slots=True)
class Quaternion:
    """geometry_msgs/Quaternion: of unit length."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    w: float = 1.0


@dataclass(slots=True)
class Transform:
    """geometry_msgs/Transform."""

    translation: Vector3 = field(default_factory=Vector3)
    rotation: Quaternion = field(default_factory=Quaternion)


@dataclass(slots=True)
class TransformStamped:
    """geometry_msgs/TransformStamped: the pose of a child frame in the header's frame."""

    header: Header = field(default_factory=Header)
    child_frame_id: str = ""
    transform: Transform = field(default_factory=Transform)


def nanoseconds(time: Any) -> int:
    """Return a time or a duration in nanoseconds.

    Raises:
        TypeError: if it has neither ``nanoseconds`` nor ``sec`` and ``nanosec``, and is not an
            int.
    """
    try:
        return int(time.nanoseconds)
    except AttributeError:
        pass
    try:
        return int(time.sec) * _SECOND_NS + int(time.nanosec)
    except AttributeError:
        pass
    if isinstance(time, int) and not isinstance(time, bool):
        return time
    raise TypeError(
        f"{time!r} is not a time: neither an int nor a message with nanoseconds or sec and nanosec"
    )


def time_of(stamp_ns: int) -> Any:
    """Return rclpy's ``Time`` if the program has loaded it, otherwise this module's."""
    rclpy_time = sys.modules.get("rclpy.time")
    if rclpy_time is not None:
        return rclpy_time.Time(nanoseconds=stamp_ns)
    return Time(*divmod(stamp_ns, _SECOND_NS))


def transform_stamped(target: str, source: str, stamp_ns: int, pose: PoseTuple) -> Any:
    """Return the pose of ``source`` in ``target`` as a message."""
    make = _makers.get("geometry_msgs")
    if make is None:
        if "geometry_msgs.msg" not in sys.modules:
            return _plain_message(target, source, stamp_ns, pose)
        make = _makers["geometry_msgs"] = _ros_maker()
    return make(target, source, stamp_ns, pose)


_makers: dict[str, Maker] = {}


def _plain_message(target: str, source: str, stamp_ns: int, pose: PoseTuple) -> TransformStamped:
    x, y, z, qx, qy, qz, qw = pose
    header = Header(Time(*divmod(stamp_ns, _SECOND_NS)), target)
    return TransformStamped(
        header, source, Transform(Vector3(x, y, z), Quaternion(qx, qy, qz, qw))
    )


def _ros_maker() -> Maker:
    """Return the function that creates ROS's message.

    It sets fields directly if the result equals that of the constructor.
    """
    slow = _by_constructor()
    try:
        fast = _by_fields()
        example = ("a", "b", 3_000_000_004, (1.0, 2.0, 3.0, 0.5, 0.5, 0.5, 0.5))
        same = fast(*example) == slow(*example) and repr(fast(*example)) == repr(slow(*example))
    except AttributeError:
        return slow
    return fast if same else slow


def _by_constructor() -> Maker:
    module = sys.modules["geometry_msgs.msg"]

    def make(target: str, source: str, stamp_ns: int, pose: PoseTuple) -> Any:
        message = module.TransformStamped()
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp_ns, _SECOND_NS)
        message.header.frame_id, message.child_frame_id = target, source
        to, rotation = message.transform.translation, message.transform.rotation
        to.x, to.y, to.z, rotation.x, rotation.y, rotation.z, rotation.w = pose
        return message

    return make


def _by_fields() -> Maker:
    """Return a function that creates rosidl's Python messages (Jazzy) without default values."""
    module = sys.modules["geometry_msgs.msg"]
    empty = module.TransformStamped()
    classes: tuple[Any, Any, Any] = (type(empty), type(empty.header), type(empty.header.stamp))
    stamped, header, time = classes
    transform, vector, quaternion = module.Transform, module.Vector3, module.Quaternion
    checked = empty._check_fields  # noqa: SLF001 (what the constructor would set)

    def make(target: str, source: str, stamp_ns: int, pose: PoseTuple) -> Any:
        message, head, stamp = stamped.__new__(stamped), header.__new__(header), time.__new__(time)
        moved, to, rotation = (
            transform.__new__(transform),
            vector.__new__(vector),
            quaternion.__new__(quaternion),
        )
        message._check_fields = head._check_fields = stamp._check_fields = checked  # noqa: SLF001
        moved._check_fields = to._check_fields = rotation._check_fields = checked  # noqa: SLF001
        stamp._sec, stamp._nanosec = divmod(stamp_ns, _SECOND_NS)  # noqa: SLF001
        head._stamp, head._frame_id = stamp, target  # noqa: SLF001
        to._x, to._y, to._z, rotation._x, rotation._y, rotation._z, rotation._w = pose  # noqa: SLF001
        moved._translation, moved._rotation = to, rotation  # noqa: SLF001
        message._header, message._child_frame_id, message._transform = (  # noqa: SLF001
            head,
            source,
            moved,
        )
        return message

    return make


# Transforms of messages, as in tf2_geometry_msgs and tf2_sensor_msgs.


def do_transform_point(point: Any, transform: Any) -> Any:
    """Return a PointStamped in the transform's frame."""
    moved = _with_header_of(point, transform)
    to = moved.point
    to.x, to.y, to.z = product(pose_of(transform), (to.x, to.y, to.z, 0.0, 0.0, 0.0, 1.0))[:3]
    return moved


def do_transform_vector3(vector: Any, transform: Any) -> Any:
    """Return a Vector3Stamped in the transform's frame: rotated, not translated."""
    moved = _with_header_of(vector, transform)
    to, rotation = moved.vector, (0.0, 0.0, 0.0, *pose_of(transform)[3:])
    to.x, to.y, to.z = product(rotation, (to.x, to.y, to.z, 0.0, 0.0, 0.0, 1.0))[:3]
    return moved


def do_transform_pose(pose: Any, transform: Any) -> Any:
    """Return a Pose, which has no header, in the transform's frame.

    A quaternion of zeros counts as no rotation.
    """
    moved = deepcopy(pose)
    position, rotation = moved.position, moved.orientation
    length = hypot(rotation.x, rotation.y, rotation.z, rotation.w)
    quat = (
        tuple(part / length for part in (rotation.x, rotation.y, rotation.z, rotation.w))
        if length
        else (0.0, 0.0, 0.0, 1.0)
    )
    numbers = (position.x, position.y, position.z, quat[0], quat[1], quat[2], quat[3])
    position.x, position.y, position.z, rotation.x, rotation.y, rotation.z, rotation.w = unit(
        product(pose_of(transform), numbers)
    )
    return moved


def do_transform_pose_stamped(pose: Any, transform: Any) -> Any:
    """Return a PoseStamped in the transform's frame."""
    moved = _with_header_of(pose, transform)
    moved.pose = do_transform_pose(pose.pose, transform)
    return moved


def do_transform_pose_with_covariance_stamped(pose: Any, transform: Any) -> Any:
    """Return a PoseWithCovarianceStamped in the transform's frame.

    The covariance is rotated, too.
    """
    moved = _with_header_of(pose, transform)
    moved.pose.pose = do_transform_pose(pose.pose.pose, transform)
    moved.pose.covariance = transform_covariance(pose.pose.covariance, transform)
    return moved


def transform_covariance(covariance: Sequence[float], transform: Any) -> list[float]:
    """Return a 6×6 covariance (36 numbers by rows) with its axes rotated: R·C·Rᵀ.

    Each of its four 3×3 blocks is rotated separately.
    """
    _, _, _, x, y, z, w = pose_of(transform)
    rotation = matrix_from_quat((x, y, z, w))
    moved = [0.0] * 36
    for top in (0, 3):
        for left in (0, 3):
            block = [
                [float(covariance[6 * (top + i) + left + j]) for j in range(3)] for i in range(3)
            ]
            for i in range(3):
                for j in range(3):
                    moved[6 * (top + i) + left + j] = sum(
                        rotation[i][k] * block[k][m] * rotation[j][m]
                        for k in range(3)
                        for m in range(3)
                    )
    return moved


def transform_points(point_cloud: ArrayLike, transform: Any) -> NDArray[Any]:
    """Return points, N×3 in m, transformed as in tf2_sensor_msgs. Requires numpy.

    Raises:
        InvalidArgumentException: if the last dimension is not 3.
        ImportError: if numpy is not installed.
    """
    require_numpy()
    from tfcompose.tf.tf2.arrays import transform_points_array  # noqa: PLC0415 (numpy is optional)

    return transform_points_array(point_cloud, pose_of(transform))


def do_transform_polygon_stamped(polygon: Any, transform: Any) -> Any:
    """Return a PolygonStamped in the transform's frame."""
    moved, pose = _with_header_of(polygon, transform), pose_of(transform)
    for corner in moved.polygon.points:
        corner.x, corner.y, corner.z = product(
            pose, (corner.x, corner.y, corner.z, 0.0, 0.0, 0.0, 1.0)
        )[:3]
    return moved


def do_transform_cloud(cloud: Any, transform: Any) -> Any:
    """Return a PointCloud2 in the transform's frame.

    The function transforms x, y and z, and keeps the other bytes. The fields may have any order,
    offsets, padding and byte order, and be float32 or float64. The cloud may be organised and
    contain NaN. The stamp stays the cloud's. Requires numpy.

    Raises:
        InvalidArgumentException: if there is no x, y or z of such a type, or less data than the
            cloud claims to have.
    """
    require_numpy()
    from tfcompose.tf.tf2.arrays import transform_cloud  # noqa: PLC0415 (numpy is optional)

    moved = transform_cloud(cloud, pose_of(transform))
    moved.header = _copy_with_header(cloud.header, cloud.header.stamp)
    moved.header.frame_id = getattr(transform, "header", cloud.header).frame_id
    return moved


#: Functions for ``Buffer.transform`` by the name of the message type. ``registration`` adds
#: others.
TRANSFORMS: dict[str, Callable[[Any, Any], Any]] = {
    "PointStamped": do_transform_point,
    "Vector3Stamped": do_transform_vector3,
    "PoseStamped": do_transform_pose_stamped,
    "PoseWithCovarianceStamped": do_transform_pose_with_covariance_stamped,
    "PolygonStamped": do_transform_polygon_stamped,
    "PointCloud2": do_transform_cloud,
}


def require_numpy() -> None:
    """Raise an ImportError that tells what to install if numpy is missing."""
    if find_spec("numpy") is None:
        raise ImportError(
            "many points or poses at once need numpy: pip install 'tfcompose[arrays]'"
        )


def pose_of(transform: Any) -> PoseTuple:
    """Return the pose of a TransformStamped, or of a Transform, as numbers.

    Its quaternion is normalised. A quaternion of zeros counts as no rotation, as in tf2.
    """
    inner = getattr(transform, "transform", transform)
    to, rotation = inner.translation, inner.rotation
    quat = (rotation.x, rotation.y, rotation.z, rotation.w)
    return unit((to.x, to.y, to.z, *(quat if any(quat) else IDENTITY[3:])))


def _copy_with_header(headed: Any, stamp: Any) -> Any:
    """Return a copy of a message or header with the given stamp.

    rclpy's ``Time`` can be neither copied nor changed.
    """
    return deepcopy(headed, {} if hasattr(stamp, "sec") else {id(stamp): stamp})


def _with_header_of(message: Any, transform: Any) -> Any:
    """Return a copy of the message with the frame and the time of the transform."""
    copied = _copy_with_header(message, message.header.stamp)
    copied.header.frame_id, stamp_ns = (
        transform.header.frame_id,
        nanoseconds(transform.header.stamp),
    )
    if hasattr(copied.header.stamp, "sec"):
        copied.header.stamp.sec, copied.header.stamp.nanosec = divmod(stamp_ns, _SECOND_NS)
    else:
        copied.header.stamp = time_of(stamp_ns)
    return copied


# Types that can be transformed, and converted into each other, as in tf2_ros.


class TransformRegistration:
    """Functions that transform objects, by type.

    Functions for built-in messages are found by the type's name.
    """

    _moves: ClassVar[dict[type, Move]] = {}

    def add(self, key: type, callback: Move) -> None:
        """Register a function with which ``Buffer.transform`` transforms objects of a type.

        ``callback(object, transform)`` returns the transformed object.
        """
        self._moves[key] = callback

    def get(self, key: type) -> Move:
        """Return the function that transforms objects of a type.

        Raises:
            TypeException: if there is no such function.
        """
        move = self._moves.get(key) or TRANSFORMS.get(key.__name__)
        if move is None:
            names = [*TRANSFORMS, *(each.__name__ for each in self._moves)]
            raise TypeException(
                f"a {key.__name__} cannot be transformed; what can is {', '.join(names)}"
            )
        return move

    def print_me(self) -> None:
        """Print the names of the types that can be transformed."""
        sys.stdout.write("\n".join([*TRANSFORMS, *(each.__name__ for each in self._moves)]) + "\n")


class ConvertRegistration:
    """Functions that convert objects of one type into another, directly or through a message."""

    _to_msg: ClassVar[dict[type, Conversion]] = {}
    _from_msg: ClassVar[dict[type, Conversion]] = {}
    _direct: ClassVar[dict[tuple[type, type], Conversion]] = {}

    def add_to_msg(self, key: type, callback: Conversion) -> None:
        """Register the conversion of this type to a message."""
        self._to_msg[key] = callback

    def add_from_msg(self, key: type, callback: Conversion) -> None:
        """Register the conversion of a message to this type."""
        self._from_msg[key] = callback

    def add_convert(self, key: tuple[type, type], callback: Conversion) -> None:
        """Register the conversion of the first type to the second."""
        self._direct[key] = callback

    def get_to_msg(self, key: type) -> Conversion:
        """Return the conversion to a message; for a message, the identity.

        Raises:
            TypeException: if there is no such conversion.
        """
        return self._to_msg.get(key) or _itself(key)

    def get_from_msg(self, key: type) -> Conversion:
        """Return the conversion of a message to this type.

        Raises:
            TypeException: if there is no such conversion.
        """
        return self._from_msg.get(key) or _itself(key)

    def get_convert(self, key: tuple[type, type]) -> Conversion:
        """Return the conversion of the first type to the second.

        Raises:
            TypeException: if there is no such conversion.
        """
        if key not in self._direct:
            raise TypeException(f"nothing turns a {key[0].__name__} into a {key[1].__name__}")
        return self._direct[key]


def convert(a: Any, b_type: type) -> Any:
    """Return an object converted to another type.

    The object is converted directly, copied, or converted through a message.

    Raises:
        TypeException: if no such conversion is registered.
    """
    registry = ConvertRegistration()
    try:
        return registry.get_convert((type(a), b_type))(a)
    except TypeException:
        if type(a) is b_type:
            return deepcopy(a)
    made = registry.get_from_msg(b_type)(registry.get_to_msg(type(a))(a))
    if type(made) is not b_type:
        raise TypeException(f"nothing turns a {type(a).__name__} into a {b_type.__name__}")
    return made


def Stamped(obj: Any, stamp: Any, frame_id: str) -> Any:  # noqa: N802 (tf2_ros's name)
    """Return the object with a header: ROS's if the program has loaded it."""
    made = getattr(sys.modules.get("std_msgs.msg"), "Header", Header)
    obj.header = made(stamp=stamp, frame_id=frame_id)
    return obj


def _itself(key: type) -> Conversion:
    if key.__name__ not in TRANSFORMS:
        raise TypeException(f"a {key.__name__} cannot be turned into a message, nor made of one")
    return lambda message: message
