"""rosidl's C structures of a message type, as ctypes sees them, and what can be read out of them.

Sources: rosidl (Jazzy) ``message_type_support_struct.h``, ``type_hash.h``, ``type_description/*__struct.h`` and
``message_introspection.h``; rosidl_typesupport_fastrtps (Jazzy) ``message_type_support.h``. No compiler checks these
layouts: whoever reads a structure looks whether it holds what it must.
"""

from __future__ import annotations

import ctypes
import json
from hashlib import sha256
from typing import Any

# More than any message has: what a structure that is not the expected one may claim.
_MOST = 1000

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
    """rosidl_typesupport_fastrtps_cpp's message_type_support_callbacks_t; C++ namespace and name come first."""

    _fields_ = (("namespace", ctypes.c_char_p), ("name", ctypes.c_char_p), ("functions", Pointer * 5))


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

    _fields_ = (("data", ctypes.c_char_p), ("size", ctypes.c_size_t), ("capacity", ctypes.c_size_t))

    @classmethod
    def of(cls, text: str) -> String:
        """Return the string; it lives as long as what is returned."""
        raw = text.encode()
        return cls(raw, len(raw), len(raw) + 1)

    @property
    def text(self) -> str:
        """The string in Python; a ValueError if it is shorter or longer than it says."""
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


class Field(ctypes.Structure):
    """rosidl_runtime_c__type_description__Field."""

    _fields_ = (("name", String), ("type", FieldType), ("default_value", String))


class Fields(ctypes.Structure):
    """A sequence of ``Field``; every sequence in C messages has this size."""

    _fields_ = (("data", ctypes.POINTER(Field)), ("size", ctypes.c_size_t), ("capacity", ctypes.c_size_t))


class Type(ctypes.Structure):
    """rosidl_runtime_c__type_description__IndividualTypeDescription."""

    _fields_ = (("type_name", String), ("fields", Fields))


class Types(ctypes.Structure):
    """A sequence of ``Type``."""

    _fields_ = (("data", ctypes.POINTER(Type)), ("size", ctypes.c_size_t), ("capacity", ctypes.c_size_t))


class Description(ctypes.Structure):
    """rosidl_runtime_c__type_description__TypeDescription."""

    _fields_ = (("type_description", Type), ("referenced", Types))


def type_hash(description: dict[str, Any]) -> str:
    """Return the RIHS01 hash of a type description without default values: SHA-256 of its JSON (REP-2016)."""
    return "RIHS01_" + sha256(json.dumps(description).encode()).hexdigest()


def description_json(type_support: int) -> dict[str, Any]:
    """Return what the type support at that address says of its type, ready for ``type_hash``.

    Raises:
        ValueError: if there are no such structures at that address.
    """
    found = described(TypeSupport.from_address(type_support), type_support)
    referenced = found.referenced
    return {
        "type_description": _type_json(found.type_description),
        "referenced_type_descriptions": [_type_json(each) for each in referenced.data[: _few(referenced.size)]],
    }


def hash_text(type_support: int) -> str:
    """Return the hash that the type support at that address gives, in the form of REP-2016."""
    getter = Getter(TypeSupport.from_address(type_support).get_hash)
    found = Hash.from_address(getter(type_support))
    return f"RIHS{found.version:02}_{bytes(found.value).hex()}"


def capsule_address(capsule: object) -> int:
    """Return the address in one of the capsules without a name that rosidl's Python classes carry."""
    get = ctypes.pythonapi.PyCapsule_GetPointer
    get.restype, get.argtypes = Pointer, (ctypes.py_object, ctypes.c_char_p)
    return int(get(capsule, None))


def described(support: TypeSupport, address: int) -> Description:
    """Return the description that a type support at that address gives; a ValueError if it gives none."""
    where = Getter(support.get_description)(address)
    if not where:
        raise ValueError("a type without a description")
    return Description.from_address(where)


def _type_json(described: Type) -> dict[str, Any]:
    fields = described.fields
    return {
        "type_name": described.type_name.text,
        "fields": [_field_json(field) for field in fields.data[: _few(fields.size)]],
    }


def _field_json(field: Field) -> dict[str, Any]:
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
