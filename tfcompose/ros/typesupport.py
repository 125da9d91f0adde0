"""The type of TFMessage for rclpy: the installed ``tf2_msgs``, or an own type support where there is none.

PyPI has rclpy and geometry_msgs but no tf2_msgs, and a type support is normally compiled. tfcompose publishes and
takes finished bytes only, and for that rclpy and rmw_fastrtps_cpp need no more than the type's name, shape, description
and hash. All else is borrowed from ``geometry_msgs/TransformStamped``, at run time, with ctypes:

- the type support of TFMessage is a ``rosidl_message_type_support_t`` that, asked for ``rosidl_typesupport_fastrtps_c``
  or ``rosidl_typesupport_introspection_c``, gives one of two further ones, and none for any other;
- the first holds a copy of TransformStamped's callbacks with TFMessage's namespace and name;
- the second says that there is one member, ``transforms``, a sequence of TransformStamped;
- the description is made here, with those of the types that it refers to copied from TransformStamped's.
  The texts of the message files are TransformStamped's; no node of tfcompose serves them.

What ``rosidl`` says of the structures is checked before use: names are where they are expected, and both types' hashes,
computed from the descriptions (REP-2016), are the ones that ROS knows.
"""

from __future__ import annotations

import ctypes
from functools import cache
from importlib.util import find_spec
from typing import Any

from rclpy.utilities import get_rmw_implementation_identifier
from rosidl_generator_py import import_type_support

from tfcompose.ros import rosidl
from tfcompose.ros.environment import RosError
from tfcompose.ros.message import TF_MESSAGE, TF_MESSAGE_HASH

_RMW = "rmw_fastrtps_cpp"
_FASTRTPS = b"rosidl_typesupport_fastrtps_c"
_INTROSPECTION = b"rosidl_typesupport_introspection_c"
_STAMPED = "geometry_msgs/msg/TransformStamped"
# type_description_interfaces/msg/FieldType: NESTED_TYPE and NESTED_TYPE_UNBOUNDED_SEQUENCE.
_UNBOUNDED_SEQUENCE_OF_MESSAGES = 145
# rosidl_typesupport_introspection_c ``field_types.h``.
_ROS_TYPE_MESSAGE = 18


@cache
def tf_message_type() -> Any:
    """Return the class to give rclpy for ``tf2_msgs/msg/TFMessage``; only its bytes can be published and taken.

    Raises:
        RosError: if tf2_msgs is not installed and ROS is not as the own type support needs it.
    """
    if find_spec("tf2_msgs") is not None:
        from tf2_msgs.msg import TFMessage  # noqa: PLC0415 (there is none with the wheels from PyPI)

        return TFMessage
    return own_type()


def own_type() -> Any:
    """Return a class with an own type support, as ``tf_message_type`` does without tf2_msgs.

    Raises:
        RosError: if the rmw is not rmw_fastrtps_cpp, or rosidl's structures are not the expected ones.
    """
    rmw = get_rmw_implementation_identifier()
    if rmw != _RMW:
        raise RosError(f"with {rmw} the package tf2_msgs is needed: install ros-jazzy-tf2-msgs, or use {_RMW}")
    if find_spec("rclpy.type_hash") is None:  # before Iron a type support had no hash and no description
        raise RosError("this ROS is older than Jazzy: install the package tf2_msgs")
    try:
        return _message_class(*_build())
    except (ValueError, UnicodeDecodeError) as error:
        raise RosError(f"this rosidl is not laid out as Jazzy's ({error}): install the package tf2_msgs") from None


def _build() -> tuple[rosidl.TypeSupport, list[Any]]:
    """Return the type support and all that it points to, which must live as long."""
    stamped = _stamped()
    fast, introspection = _other(stamped, _FASTRTPS), _other(stamped, _INTROSPECTION)
    callbacks, members = _callbacks(fast), _members(introspection)
    description, described = _description(rosidl.described(fast, ctypes.addressof(fast)))
    value = (ctypes.c_uint8 * 32).from_buffer_copy(bytes.fromhex(TF_MESSAGE_HASH.removeprefix("RIHS01_")))
    hashed = rosidl.Hash(1, value)
    getters = [_getter(hashed), _getter(description)]

    answers: dict[bytes, int] = {}
    answer = rosidl.Handle(lambda _, identifier: answers.get(identifier))
    alive: list[Any] = [callbacks, members, description, described, hashed, getters, answer]
    for borrowed, data in ((fast, callbacks), (introspection, members)):
        made = rosidl.TypeSupport.from_buffer_copy(borrowed)
        made.data = ctypes.addressof(data)
        made.func = ctypes.cast(answer, rosidl.Pointer)
        made.get_hash, made.get_description = (ctypes.cast(getter, rosidl.Pointer) for getter in getters)
        answers[made.identifier] = ctypes.addressof(made)
        alive.append(made)
    if rosidl.type_hash(rosidl.description_json(ctypes.addressof(made))) != TF_MESSAGE_HASH:
        raise ValueError("the description made for TFMessage is not TFMessage's")
    return made, alive


def _other(stamped: int, identifier: bytes) -> rosidl.TypeSupport:
    """Return TransformStamped's type support of that name."""
    found = rosidl.Handle(rosidl.TypeSupport.from_address(stamped).func)(stamped, identifier)
    if not found or rosidl.TypeSupport.from_address(found).identifier != identifier:
        raise ValueError(f"TransformStamped has no {identifier.decode()}")
    return rosidl.TypeSupport.from_address(found)


def _callbacks(fast: rosidl.TypeSupport) -> rosidl.Callbacks:
    made = rosidl.Callbacks.from_buffer_copy(rosidl.Callbacks.from_address(fast.data))
    if (made.namespace, made.name) != (b"geometry_msgs::msg", b"TransformStamped"):
        raise ValueError("TransformStamped's callbacks do not start with its name")
    made.namespace, made.name = b"tf2_msgs::msg", b"TFMessage"
    return made


def _members(introspection: rosidl.TypeSupport) -> rosidl.Members:
    known = rosidl.Members.from_address(introspection.data)
    names = (known.namespace, known.name, known.count)
    if names != (b"geometry_msgs__msg", b"TransformStamped", 3):
        raise ValueError("TransformStamped's members do not start with its name")
    if [member.name for member in known.members[:3]] != [b"header", b"child_frame_id", b"transform"]:
        raise ValueError("TransformStamped's members are not its own")
    address = ctypes.addressof(introspection)
    member = rosidl.Member(b"transforms", _ROS_TYPE_MESSAGE, 0, address, is_key=False, is_array=True)
    return rosidl.Members(
        b"tf2_msgs__msg", b"TFMessage", 1, ctypes.sizeof(rosidl.Fields), members=ctypes.pointer(member)
    )


def _getter(structure: ctypes.Structure) -> Any:
    where = ctypes.addressof(structure)
    return rosidl.Getter(lambda _: where)


def _stamped() -> int:
    """Return the address of TransformStamped's type support, after looking whether it is laid out as expected.

    It is taken as ``geometry_msgs.msg`` takes it, but without that, which imports numpy for its covariances.
    """
    capsule = getattr(import_type_support("geometry_msgs"), "type_support_msg__msg__transform_stamped", None)
    if capsule is None:
        raise ValueError("geometry_msgs has no type support of TransformStamped")
    stamped = rosidl.capsule_address(capsule)
    described = rosidl.description_json(stamped)
    if described["type_description"]["type_name"] != _STAMPED or rosidl.type_hash(described) != rosidl.hash_text(
        stamped
    ):
        raise ValueError("TransformStamped's description and hash do not agree")
    return stamped


def _description(stamped: rosidl.Description) -> tuple[rosidl.Description, list[Any]]:
    """Return TFMessage's description, and what it points to."""
    kind = rosidl.FieldType(_UNBOUNDED_SEQUENCE_OF_MESSAGES, 0, 0, rosidl.String.of(_STAMPED))
    field = rosidl.Field(rosidl.String.of("transforms"), kind, rosidl.String.of(""))
    known = [*stamped.referenced.data[: stamped.referenced.size], stamped.type_description]
    known.sort(key=lambda each: each.type_name.text)
    types = (rosidl.Type * len(known))(*known)
    fields = rosidl.Fields(ctypes.pointer(field), 1, 1)
    made = rosidl.Description(
        rosidl.Type(rosidl.String.of(TF_MESSAGE), fields), rosidl.Types(types, len(known), len(known))
    )
    return made, [field, types]


def _message_class(support: rosidl.TypeSupport, alive: list[Any]) -> Any:
    new = ctypes.pythonapi.PyCapsule_New
    new.restype, new.argtypes = ctypes.py_object, (rosidl.Pointer, ctypes.c_char_p, rosidl.Pointer)
    # rclpy wants all five. The last four convert messages that are objects; they are no capsules, so that a use raises.
    converters = ("_CREATE_ROS_MESSAGE", "_CONVERT_FROM_PY", "_CONVERT_TO_PY", "_DESTROY_ROS_MESSAGE")
    attributes = {"_TYPE_SUPPORT": new(ctypes.addressof(support), None, None), "_alive": (support, alive)}
    meta = type("Metaclass_TFMessage", (type,), attributes | dict.fromkeys(converters, "tfcompose uses bytes"))
    return meta("TFMessage", (), {"__doc__": "tf2_msgs/msg/TFMessage, as bytes only.", "__module__": __name__})
