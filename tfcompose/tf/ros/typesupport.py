"""The type of TFMessage for rclpy: the installed ``tf2_msgs``, or our own type support.

PyPI has rclpy and geometry_msgs but no tf2_msgs, and a type support is normally compiled code.
tfcompose only publishes and takes serialised messages. For that, rclpy and rmw_fastrtps_cpp need
only the type's name, shape, description and hash. Everything else is borrowed from
``geometry_msgs/TransformStamped`` at run time, with ctypes:

- The type support of TFMessage is a ``rosidl_message_type_support_t``. For
  ``rosidl_typesupport_fastrtps_c`` and ``rosidl_typesupport_introspection_c`` it returns one of
  two further type supports, and for any other identifier none.
- The first has a copy of TransformStamped's callbacks with TFMessage's namespace and name.
- The second declares a single member, ``transforms``, a sequence of TransformStamped.
- The description is built here. Descriptions of the types that it refers to are copied from
  TransformStamped's. The texts of the message files are TransformStamped's; no node of tfcompose
  serves them.

The module begins with rosidl's C structures for ctypes. Sources: rosidl (Jazzy)
``message_type_support_struct.h``, ``type_hash.h``, ``type_description/*__struct.h`` and
``message_introspection.h``; rosidl_typesupport_fastrtps (Jazzy) ``message_type_support.h``. No
compiler checks these layouts. So all values are checked before use: names are at the expected
places, and both types' hashes, computed from the descriptions (REP-2016), are the known ones.
"""

from __future__ import annotations

import ctypes
import json
from functools import cache
from hashlib import sha256
from importlib.util import find_spec
from typing import Any

from rclpy.type_support import check_for_type_support
from rclpy.utilities import get_rmw_implementation_identifier
from rosidl_generator_py import import_type_support

from tfcompose.tf.ros.environment import RosError
from tfcompose.tf.ros.tf_codec import TF_MESSAGE, TF_MESSAGE_HASH

_RMW = "rmw_fastrtps_cpp"
_FASTRTPS = b"rosidl_typesupport_fastrtps_c"
_INTROSPECTION = b"rosidl_typesupport_introspection_c"
_STAMPED = "geometry_msgs/msg/TransformStamped"
# type_description_interfaces/msg/FieldType: NESTED_TYPE and NESTED_TYPE_UNBOUNDED_SEQUENCE.
_UNBOUNDED_SEQUENCE_OF_MESSAGES = 145
# rosidl_typesupport_introspection_c ``field_types.h``.
_ROS_TYPE_MESSAGE = 18

# Upper limit for plausible counts. A structure with another layout may claim more.
_MOST = 1000

# rosidl's structures.

Pointer = ctypes.c_void_p
Handle = ctypes.CFUNCTYPE(Pointer, Pointer, ctypes.c_char_p)
Getter = ctypes.CFUNCTYPE(Pointer, Pointer)


class TypeSupport(ctypes.Structure):
    """rosidl_message_type_support_t."""

    _fields_ = (
        ("identifier", ctypes.c_char_p),
        ("data", Pointer),
        ("func", Pointer),
        ("get_hash", Pointer),
        ("get_description", Pointer),
        ("get_sources", Pointer),
    )


class Callbacks(ctypes.Structure):
    """rosidl_typesupport_fastrtps_cpp's message_type_support_callbacks_t.

    C++ namespace and name come first.
    """

    _fields_ = (
        ("namespace", ctypes.c_char_p),
        ("name", ctypes.c_char_p),
        ("functions", Pointer * 5),
    )


class Member(ctypes.Structure):
    """rosidl_typesupport_introspection_c__MessageMember."""

    _fields_ = (
        ("name", ctypes.c_char_p),
        ("type_id", ctypes.c_uint8),
        ("string_upper_bound", ctypes.c_size_t),
        ("members", Pointer),
        ("is_key", ctypes.c_bool),
        ("is_array", ctypes.c_bool),
        ("array_size", ctypes.c_size_t),
        ("is_upper_bound", ctypes.c_bool),
        ("offset", ctypes.c_uint32),
        ("default_value", Pointer),
        ("functions", Pointer * 6),
    )


class Members(ctypes.Structure):
    """rosidl_typesupport_introspection_c__MessageMembers."""

    _fields_ = (
        ("namespace", ctypes.c_char_p),
        ("name", ctypes.c_char_p),
        ("count", ctypes.c_uint32),
        ("size_of", ctypes.c_size_t),
        ("has_any_key_member", ctypes.c_bool),
        ("members", ctypes.POINTER(Member)),
        ("init_and_fini", Pointer * 2),
    )


class Hash(ctypes.Structure):
    """rosidl_type_hash_t."""

    _fields_ = (("version", ctypes.c_uint8), ("value", ctypes.c_uint8 * 32))


class String(ctypes.Structure):
    """rosidl_runtime_c__String."""

    _fields_ = (
        ("data", ctypes.c_char_p),
        ("size", ctypes.c_size_t),
        ("capacity", ctypes.c_size_t),
    )

    @classmethod
    def of(cls, text: str) -> String:
        """Return the string. It lives as long as the returned object."""
        raw = text.encode()
        return cls(raw, len(raw), len(raw) + 1)

    @property
    def text(self) -> str:
        """The string in Python. Raises a ValueError if its length is wrong."""
        raw: bytes = self.data or b""
        if len(raw) != self.size:
            raise ValueError("a string is shorter or longer than it says")
        return raw.decode()


class FieldType(ctypes.Structure):
    """rosidl_runtime_c__type_description__FieldType."""

    _fields_ = (
        ("type_id", ctypes.c_uint8),
        ("capacity", ctypes.c_uint64),
        ("string_capacity", ctypes.c_uint64),
        ("nested_type_name", String),
    )


class FieldDescription(ctypes.Structure):
    """rosidl_runtime_c__type_description__Field."""

    _fields_ = (("name", String), ("type", FieldType), ("default_value", String))


class Fields(ctypes.Structure):
    """A sequence of ``FieldDescription``. Every sequence in C messages has this size."""

    _fields_ = (
        ("data", ctypes.POINTER(FieldDescription)),
        ("size", ctypes.c_size_t),
        ("capacity", ctypes.c_size_t),
    )


class Type(ctypes.Structure):
    """rosidl_runtime_c__type_description__IndividualTypeDescription."""

    _fields_ = (("type_name", String), ("fields", Fields))


class Types(ctypes.Structure):
    """A sequence of ``Type``."""

    _fields_ = (
        ("data", ctypes.POINTER(Type)),
        ("size", ctypes.c_size_t),
        ("capacity", ctypes.c_size_t),
    )


class TypeDescription(ctypes.Structure):
    """rosidl_runtime_c__type_description__TypeDescription."""

    _fields_ = (("type_description", Type), ("referenced", Types))


# The type of TFMessage.


@cache
def tf_message_type() -> Any:
    """Return the class that rclpy needs for ``tf2_msgs/msg/TFMessage``.

    Only its bytes can be published and taken.

    Raises:
        RosError: if tf2_msgs is not installed, and this ROS does not match our own type support.
    """
    if find_spec("tf2_msgs") is not None:
        # The wheels from PyPI lack it.
        from tf2_msgs.msg import TFMessage  # noqa: PLC0415

        load_type_support: Any = check_for_type_support  # rclpy does not say its types
        load_type_support(TFMessage)
        return TFMessage
    return own_type()


def own_type() -> Any:
    """Return a class with our own type support, as ``tf_message_type`` does without tf2_msgs.

    Raises:
        RosError: if the rmw is not rmw_fastrtps_cpp, or rosidl's structures are unexpected.
    """
    rmw = get_rmw_implementation_identifier()
    if rmw != _RMW:
        raise RosError(
            f"with {rmw} the package tf2_msgs is needed: install ros-jazzy-tf2-msgs, or use {_RMW}"
        )
    if (
        find_spec("rclpy.type_hash") is None
    ):  # before Iron a type support had no hash and no description
        raise RosError("this ROS is older than Jazzy: install the package tf2_msgs")
    try:
        return _message_class(*_build())
    except (ValueError, UnicodeDecodeError) as error:
        raise RosError(
            f"this rosidl is not laid out as Jazzy's ({error}): install the package tf2_msgs"
        ) from None


def _build() -> tuple[TypeSupport, list[Any]]:
    """Return the type support and everything that it points to, which must live as long."""
    stamped = _stamped_typesupport()
    fast, introspection = (
        _find_type_support(stamped, _FASTRTPS),
        _find_type_support(stamped, _INTROSPECTION),
    )
    callbacks, members = _callbacks(fast), _members(introspection)
    description, described = _description(description_of(fast, ctypes.addressof(fast)))
    value = (ctypes.c_uint8 * 32).from_buffer_copy(
        bytes.fromhex(TF_MESSAGE_HASH.removeprefix("RIHS01_"))
    )
    hashed = Hash(1, value)
    getters = [_getter(hashed), _getter(description)]

    answers: dict[bytes, int] = {}
    answer = Handle(lambda _, identifier: answers.get(identifier))
    alive: list[Any] = [callbacks, members, description, described, hashed, getters, answer]
    for borrowed, data in ((fast, callbacks), (introspection, members)):
        made = TypeSupport.from_buffer_copy(borrowed)
        made.data = ctypes.addressof(data)
        made.func = ctypes.cast(answer, Pointer)
        made.get_hash, made.get_description = (ctypes.cast(getter, Pointer) for getter in getters)
        answers[made.identifier] = ctypes.addressof(made)
        alive.append(made)
    if type_hash(description_json(ctypes.addressof(made))) != TF_MESSAGE_HASH:
        raise ValueError("the description made for TFMessage is not TFMessage's")
    return made, alive


def _find_type_support(stamped: int, identifier: bytes) -> TypeSupport:
    """Return TransformStamped's type support with this identifier."""
    address = Handle(TypeSupport.from_address(stamped).func)(stamped, identifier)
    if not address or TypeSupport.from_address(address).identifier != identifier:
        raise ValueError(f"TransformStamped has no {identifier.decode()}")
    return TypeSupport.from_address(address)


def _callbacks(fast: TypeSupport) -> Callbacks:
    made = Callbacks.from_buffer_copy(Callbacks.from_address(fast.data))
    if (made.namespace, made.name) != (b"geometry_msgs::msg", b"TransformStamped"):
        raise ValueError("TransformStamped's callbacks do not start with its name")
    made.namespace, made.name = b"tf2_msgs::msg", b"TFMessage"
    return made


def _members(introspection: TypeSupport) -> Members:
    members = Members.from_address(introspection.data)
    names = (members.namespace, members.name, members.count)
    if names != (b"geometry_msgs__msg", b"TransformStamped", 3):
        raise ValueError("TransformStamped's members do not start with its name")
    if [member.name for member in members.members[:3]] != [
        b"header",
        b"child_frame_id",
        b"transform",
    ]:
        raise ValueError("TransformStamped's members are not its own")
    address = ctypes.addressof(introspection)
    member = Member(b"transforms", _ROS_TYPE_MESSAGE, 0, address, is_key=False, is_array=True)
    return Members(
        b"tf2_msgs__msg", b"TFMessage", 1, ctypes.sizeof(Fields), members=ctypes.pointer(member)
    )


def _getter(structure: ctypes.Structure) -> Any:
    where = ctypes.addressof(structure)
    return Getter(lambda _: where)


def _stamped_typesupport() -> int:
    """Return the address of TransformStamped's type support, after a layout check.

    It is obtained like in ``geometry_msgs.msg``, but without importing that module, which imports
    numpy for its covariances.
    """
    capsule = getattr(
        import_type_support("geometry_msgs"), "type_support_msg__msg__transform_stamped", None
    )
    if capsule is None:
        raise ValueError("geometry_msgs has no type support of TransformStamped")
    stamped = capsule_address(capsule)
    described = description_json(stamped)
    if described["type_description"]["type_name"] != _STAMPED or type_hash(described) != hash_text(
        stamped
    ):
        raise ValueError("TransformStamped's description and hash do not agree")
    return stamped


def _description(stamped: TypeDescription) -> tuple[TypeDescription, list[Any]]:
    """Return TFMessage's description, and the objects that it points to."""
    kind = FieldType(_UNBOUNDED_SEQUENCE_OF_MESSAGES, 0, 0, String.of(_STAMPED))
    field = FieldDescription(String.of("transforms"), kind, String.of(""))
    referenced = [*stamped.referenced.data[: stamped.referenced.size], stamped.type_description]
    referenced.sort(key=lambda each: each.type_name.text)
    types = (Type * len(referenced))(*referenced)
    fields = Fields(ctypes.pointer(field), 1, 1)
    made = TypeDescription(
        Type(String.of(TF_MESSAGE), fields), Types(types, len(referenced), len(referenced))
    )
    return made, [field, types]


def _message_class(support: TypeSupport, alive: list[Any]) -> Any:
    new = ctypes.pythonapi.PyCapsule_New
    new.restype, new.argtypes = ctypes.py_object, (Pointer, ctypes.c_char_p, Pointer)
    capsule = new(ctypes.addressof(support), None, None)
    return _bytes_class(TF_MESSAGE, {"_TYPE_SUPPORT": capsule, "_alive": (support, alive)})


@cache
def joint_state_type() -> Any:
    """Return the class that rclpy needs for sensor_msgs/JointState.

    Only its bytes can be published and taken. The class is created without ``sensor_msgs.msg``,
    which imports numpy for its covariances.

    Raises:
        RosError: if sensor_msgs has no such type.
    """
    capsule = getattr(
        import_type_support("sensor_msgs"), "type_support_msg__msg__joint_state", None
    )
    if capsule is None:
        raise RosError("sensor_msgs has no type support of JointState")
    return _bytes_class("sensor_msgs/msg/JointState", {"_TYPE_SUPPORT": capsule})


def _bytes_class(type_: str, attributes: dict[str, Any]) -> Any:
    """Return a message class that rclpy accepts, but that cannot be instantiated."""
    # rclpy requires all five. The last four convert message objects. Here they are not capsules,
    # so that any use raises an error.
    converters = (
        "_CREATE_ROS_MESSAGE",
        "_CONVERT_FROM_PY",
        "_CONVERT_TO_PY",
        "_DESTROY_ROS_MESSAGE",
    )
    name = type_.rpartition("/")[2]
    meta = type(
        f"Metaclass_{name}",
        (type,),
        attributes | dict.fromkeys(converters, "tfcompose uses bytes"),
    )
    return meta(name, (), {"__doc__": f"{type_}, as bytes only.", "__module__": __name__})


# Reading rosidl's structures.


def type_hash(description: dict[str, Any]) -> str:
    """Return the RIHS01 hash of a type description without default values.

    It is the SHA-256 of the description's JSON (REP-2016).
    """
    return "RIHS01_" + sha256(json.dumps(description).encode()).hexdigest()


def description_json(type_support: int) -> dict[str, Any]:
    """Return the type description of the type support at an address, as ``type_hash`` needs it.

    Raises:
        ValueError: if there are no such structures at that address.
    """
    description = description_of(TypeSupport.from_address(type_support), type_support)
    referenced = description.referenced
    return {
        "type_description": _type_json(description.type_description),
        "referenced_type_descriptions": [
            _type_json(each) for each in referenced.data[: _few(referenced.size)]
        ],
    }


def hash_text(type_support: int) -> str:
    """Return the hash of the type support at an address, in the form of REP-2016."""
    getter = Getter(TypeSupport.from_address(type_support).get_hash)
    type_hash = Hash.from_address(getter(type_support))
    return f"RIHS{type_hash.version:02}_{bytes(type_hash.value).hex()}"


def capsule_address(capsule: object) -> int:
    """Return the address in an unnamed capsule of rosidl's Python classes."""
    get = ctypes.pythonapi.PyCapsule_GetPointer
    get.restype, get.argtypes = Pointer, (ctypes.py_object, ctypes.c_char_p)
    return int(get(capsule, None))


def description_of(support: TypeSupport, address: int) -> TypeDescription:
    """Return the description from a type support at an address.

    Raises:
        ValueError: if it has no description.
    """
    where = Getter(support.get_description)(address)
    if not where:
        raise ValueError("a type without a description")
    return TypeDescription.from_address(where)


def _type_json(described: Type) -> dict[str, Any]:
    fields = described.fields
    return {
        "type_name": described.type_name.text,
        "fields": [_field_json(field) for field in fields.data[: _few(fields.size)]],
    }


def _field_json(field: FieldDescription) -> dict[str, Any]:
    kind = field.type
    return {
        "name": field.name.text,
        "type": {
            "type_id": kind.type_id,
            "capacity": kind.capacity,
            "string_capacity": kind.string_capacity,
            "nested_type_name": kind.nested_type_name.text,
        },
    }


def _few(size: int) -> int:
    if size > _MOST:
        raise ValueError(f"a list of {size}")
    return size
