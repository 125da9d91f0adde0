"""The messages that answers are given in, and the times and durations that are taken.

A program that has loaded ROS's geometry_msgs gets its ``TransformStamped``, which it may publish; any other gets the
classes of this module, which have the same fields. Times are what has ``nanoseconds`` (rclpy's ``Time`` and
``Duration``) or ``sec`` and ``nanosec`` (the messages), or a plain int of nanoseconds.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable

    from tfcompose.observe.rotation import Seven

    Maker = Callable[[str, str, int, Seven], Any]

_SECOND_NS = 1_000_000_000


@dataclass(slots=True)
class Time:
    """builtin_interfaces/Time."""

    sec: int = 0
    nanosec: int = 0

    @property
    def nanoseconds(self) -> int:
        """The time in nanoseconds, as rclpy's ``Time`` says it."""
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
    """geometry_msgs/TransformStamped: the pose of ``child_frame_id`` in ``header.frame_id``."""

    header: Header = field(default_factory=Header)
    child_frame_id: str = ""
    transform: Transform = field(default_factory=Transform)


def nanoseconds(time: Any) -> int:
    """Return a time or a duration in nanoseconds.

    Raises:
        TypeError: if it has neither ``nanoseconds`` nor ``sec`` and ``nanosec``, and is no int.
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
    raise TypeError(f"{time!r} is no time: it has neither nanoseconds nor sec and nanosec, and is no int")


def time_of(stamp_ns: int) -> Any:
    """Return rclpy's ``Time`` where the program has loaded it, else this module's."""
    rclpy_time = sys.modules.get("rclpy.time")
    if rclpy_time is not None:
        return rclpy_time.Time(nanoseconds=stamp_ns)
    return Time(*divmod(stamp_ns, _SECOND_NS))


def transform_stamped(target: str, source: str, stamp_ns: int, pose: Seven) -> Any:
    """Return the pose of ``source`` in ``target`` as a message."""
    make = _makers.get("geometry_msgs")
    if make is None:
        if "geometry_msgs.msg" not in sys.modules:
            return _own(target, source, stamp_ns, pose)
        make = _makers["geometry_msgs"] = _ros_maker()
    return make(target, source, stamp_ns, pose)


_makers: dict[str, Maker] = {}


def _own(target: str, source: str, stamp_ns: int, pose: Seven) -> TransformStamped:
    x, y, z, qx, qy, qz, qw = pose
    header = Header(Time(*divmod(stamp_ns, _SECOND_NS)), target)
    return TransformStamped(header, source, Transform(Vector3(x, y, z), Quaternion(qx, qy, qz, qw)))


def _ros_maker() -> Maker:
    """Return what makes ROS's message: by its fields directly, if that gives the same as by its constructor."""
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

    def make(target: str, source: str, stamp_ns: int, pose: Seven) -> Any:
        message = module.TransformStamped()
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp_ns, _SECOND_NS)
        message.header.frame_id, message.child_frame_id = target, source
        to, turn = message.transform.translation, message.transform.rotation
        to.x, to.y, to.z, turn.x, turn.y, turn.z, turn.w = pose
        return message

    return make


def _by_fields() -> Maker:
    """Return a maker that sets the fields of rosidl's Python classes (Jazzy) without their default values first."""
    module = sys.modules["geometry_msgs.msg"]
    empty = module.TransformStamped()
    classes: tuple[Any, Any, Any] = (type(empty), type(empty.header), type(empty.header.stamp))
    stamped, header, time = classes
    transform, vector, quaternion = module.Transform, module.Vector3, module.Quaternion
    checked = empty._check_fields  # noqa: SLF001 (what the constructor would set)

    def make(target: str, source: str, stamp_ns: int, pose: Seven) -> Any:
        message, head, stamp = stamped.__new__(stamped), header.__new__(header), time.__new__(time)
        moved, to, turn = transform.__new__(transform), vector.__new__(vector), quaternion.__new__(quaternion)
        message._check_fields = head._check_fields = stamp._check_fields = checked  # noqa: SLF001
        moved._check_fields = to._check_fields = turn._check_fields = checked  # noqa: SLF001
        stamp._sec, stamp._nanosec = divmod(stamp_ns, _SECOND_NS)  # noqa: SLF001
        head._stamp, head._frame_id = stamp, target  # noqa: SLF001
        to._x, to._y, to._z, turn._x, turn._y, turn._z, turn._w = pose  # noqa: SLF001
        moved._translation, moved._rotation = to, turn  # noqa: SLF001
        message._header, message._child_frame_id, message._transform = head, source, moved  # noqa: SLF001
        return message

    return make
