"""Fields of dataclasses: what is said of them, and those that a base class takes over."""

from __future__ import annotations

from dataclasses import field, fields
from typing import Any, TypeVar

T = TypeVar("T")


def documented_field(default: Any, about: str, *examples: Any) -> Any:
    """Return a field of a dataclass that users write as well.

    What an editor and the reference say of the key.
    """
    more = {"examples": list(examples)} if examples else {}
    return field(default=default, metadata={"description": about, **more})


def narrow(kind: type[T], value: T, **changes: Any) -> T:
    """Return a ``kind`` with the fields of ``value``, of one of its subclasses, changed."""
    of: Any = kind
    same = {field.name: getattr(value, field.name) for field in fields(of) if field.init}
    return kind(**same | changes)
