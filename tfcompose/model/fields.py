"""Fields of dataclasses: descriptions, and copies of the fields that a base class has."""

from __future__ import annotations

from dataclasses import field, fields
from typing import Any, TypeVar

T = TypeVar("T")


def documented_field(default: Any, about: str, *examples: Any) -> Any:
    """Return a field of a dataclass that is also a mapping in robot files.

    ``about`` and ``examples`` describe the key in editors and in the reference.
    """
    more = {"examples": list(examples)} if examples else {}
    return field(default=default, metadata={"description": about, **more})


def narrow(kind: type[T], value: T, **changes: Any) -> T:
    """Return a ``kind`` with the fields of ``value``, an instance of a subclass, and changes."""
    of: Any = kind
    same = {field.name: getattr(value, field.name) for field in fields(of) if field.init}
    return kind(**same | changes)
