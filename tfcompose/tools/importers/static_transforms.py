"""Arguments of the ``static_transform_publisher`` of ROS 1 and ROS 2.

ROS 2 has named and positional arguments, ROS 1 only positional arguments. In all of them, yaw
comes first, angles are in radians about fixed axes, and quaternions are not normalised. Source:
``static_transform_broadcaster_program.cpp`` of geometry2, and ``tf`` and ``tf2_ros`` of ROS 1.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from tfcompose.foundation.geometry import Pose, norm, quat_from_rpy
from tfcompose.tools.importers.draft import pose_keys

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tfcompose.foundation.geometry import Vector

PROGRAM = "static_transform_publisher"
#: The class of the same node as a component. It gets the transform as parameters.
PLUGIN = "tf2_ros::StaticTransformBroadcasterNode"
_PARAMETERS = {
    **{f"translation.{axis}": f"--{axis}" for axis in "xyz"},
    **{f"rotation.{axis}": f"--q{axis}" for axis in "xyzw"},
    "frame_id": "--frame-id",
    "child_frame_id": "--child-frame-id",
}

#: The program that reads the arguments: of ROS 2, of ROS 1's tf, or of ROS 1's tf2_ros.
Reader = Literal["ros2", "tf", "tf2_ros"]

_POSITION = ("--x", "--y", "--z")
_QUATERNION = ("--qx", "--qy", "--qz", "--qw")
_ANGLES = ("--roll", "--pitch", "--yaw")
_FRAMES = ("--frame-id", "--child-frame-id")
_FLAGS = frozenset({*_POSITION, *_QUATERNION, *_ANGLES, *_FRAMES})
#: The numbers of positional arguments: with angles, and with a quaternion.
_WITH_ANGLES, _WITH_QUATERNION = 8, 9
#: The largest difference from 1 that tf2 accepts in the square of a quaternion's length.
_UNIT = 0.01
_LARGEST_RAD = 1e9


class ArgumentsRefusedError(ValueError):
    """The program would reject these arguments, or listeners would reject the transform."""


@dataclass(frozen=True, slots=True)
class StaticTransform:
    """A fixed edge from the arguments of its publisher."""

    parent: str
    child: str
    pose: Pose
    #: Roll, pitch and yaw in radians; None if the arguments contain a quaternion.
    rpy: Vector | None
    #: A description of the order of positional arguments; empty if the arguments are named.
    order: str

    def keys(self) -> dict[str, Any]:
        """Return the keys of its pose in a robot file."""
        return pose_keys(self.pose, self.rpy, quaternion=self.rpy is None)


def static_transform(argv: Sequence[str], reader: Reader = "ros2") -> StaticTransform:
    """Return the transform for the program's arguments; ROS arguments are ignored.

    Raises:
        ArgumentsRefusedError: if the program would reject them.
    """
    arguments = _without_ros_arguments(argv)
    if reader != "ros2":
        return _in_order(arguments, reader)
    options: dict[str, str] = {}
    positional: list[str] = []
    rest = iter(arguments)
    for argument in rest:
        if argument in _FLAGS:
            value = next(rest, None)
            if value is None:
                raise ArgumentsRefusedError(f"{argument} has no value")
            options[argument] = value
        else:
            positional.append(argument)
    if not positional:
        return _by_name(options)
    if options:
        raise ArgumentsRefusedError(
            f"{positional[0]} next to {next(iter(options))}: give arguments by name or in order"
        )
    return _in_order(positional, reader)


def static_words(params: Sequence[Any]) -> list[str]:
    """Return the arguments that are equivalent to the component's parameters."""
    options: dict[str, Any] = {}
    for param_set in params:
        options |= param_set if isinstance(param_set, dict) else {}
    return [
        argument
        for name, flag in _PARAMETERS.items()
        if name in options
        for argument in (flag, str(options[name]))
    ]


def _without_ros_arguments(argv: Sequence[str]) -> list[str]:
    """Return the arguments outside ``--ros-args … --``.

    ROS arguments of ROS 1, such as ``__name:=a``, are also left out.
    """
    arguments, inside = [], False
    for argument in argv:
        if argument == "--ros-args":
            inside = True
        elif argument == "--" and inside:
            inside = False
        elif not inside and ":=" not in argument:
            arguments.append(argument)
    return arguments


def _by_name(options: dict[str, str]) -> StaticTransform:
    numbers = {key: _number(value, key) for key, value in options.items() if key not in _FRAMES}
    x, y, z = (numbers.get(key, 0.0) for key in _POSITION)
    has_angles = any(key in numbers for key in _ANGLES)
    if has_angles and any(key in numbers for key in _QUATERNION):
        raise ArgumentsRefusedError("both angles and a quaternion")
    parent, child = (options.get(key, "") for key in _FRAMES)
    if any(key in numbers for key in _QUATERNION):
        usual = (0.0, 0.0, 0.0, 1.0)
        qx, qy, qz, qw = (
            numbers.get(key, value) for key, value in zip(_QUATERNION, usual, strict=True)
        )
        return _of(parent, child, (x, y, z), (qx, qy, qz, qw), "")
    roll, pitch, yaw = (numbers.get(key, 0.0) for key in _ANGLES)
    return _of(parent, child, (x, y, z), (roll, pitch, yaw), "")


def _in_order(argv: list[str], reader: Reader) -> StaticTransform:
    kept, period = list(argv), ""
    if reader == "tf":
        if len(kept) not in {_WITH_ANGLES + 1, _WITH_QUATERNION + 1}:
            raise ArgumentsRefusedError(
                f"{len(kept)} arguments; tf's takes 9 or 10, of which the last is the period in ms"
            )
        period = kept.pop()
        _number(period, "the period")
    if (
        not period
        and len(kept) > _WITH_ANGLES
        and _is_number(kept[-1])
        and not _is_number(kept[-3])
    ):
        raise ArgumentsRefusedError(
            f"{kept[-1]} after the frames is a period, as in ROS 1's tf; this program takes none"
        )
    if len(kept) not in {_WITH_ANGLES, _WITH_QUATERNION}:
        raise ArgumentsRefusedError(f"{len(kept)} arguments; it takes 8, or 9 with a quaternion")
    parent, child = kept[-2:]
    numbers = [
        _number(argument, f"argument {place}") for place, argument in enumerate(kept[:-2], start=1)
    ]
    x, y, z, *rest = numbers
    tail = " frame child period" if period else " frame child"
    if len(kept) == _WITH_ANGLES:
        yaw, pitch, roll = rest
        return _of(
            parent,
            child,
            (x, y, z),
            (roll, pitch, yaw),
            f"in the order x y z yaw pitch roll{tail}",
        )
    qx, qy, qz, qw = rest
    return _of(parent, child, (x, y, z), (qx, qy, qz, qw), f"in the order x y z qx qy qz qw{tail}")


def _of(
    parent: str, child: str, xyz: Vector, rotation: tuple[float, ...], order: str
) -> StaticTransform:
    if parent.startswith("/") or child.startswith("/"):
        order += "; without slashes in front of names, as tf2 has them"
        parent, child = parent.removeprefix("/"), child.removeprefix("/")
    if not parent or not child:
        raise ArgumentsRefusedError(f"the {'child' if parent else 'parent'} frame has no name")
    if parent == child:
        raise ArgumentsRefusedError(f"{child} is its own parent")
    if len(rotation) == len(_ANGLES):
        roll, pitch, yaw = rotation
        return StaticTransform(
            parent, child, Pose(xyz, quat_from_rpy(roll, pitch, yaw)), (roll, pitch, yaw), order
        )
    qx, qy, qz, qw = rotation
    length = norm(rotation)
    if abs(length**2 - 1) >= _UNIT:
        raise ArgumentsRefusedError(
            f"the quaternion has length {length:.6g}, and every listener drops the transform"
        )
    return StaticTransform(parent, child, Pose(xyz, (qx, qy, qz, qw)), None, order)


def _number(text: str, what: str) -> float:
    try:
        value = float(text)
    except ValueError:
        raise ArgumentsRefusedError(f"{what} is {text!r}, not a number") from None
    if not math.isfinite(value) or abs(value) > _LARGEST_RAD:
        raise ArgumentsRefusedError(f"{what} is {text}")
    return value


def reader_of(argv: Sequence[str]) -> Reader:
    """Return the program that reads the arguments, if the package is unknown.

    The program of ROS 1's tf has a period after the two frames.
    """
    arguments = _without_ros_arguments(argv)
    return (
        "tf"
        if len(arguments) > _WITH_ANGLES
        and _is_number(arguments[-1])
        and not _is_number(arguments[-3])
        else "ros2"
    )


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
