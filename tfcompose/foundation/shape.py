"""The structure of JSON data from a process that may have been compromised."""

from __future__ import annotations

from typing import Any


def fits(value: Any, shape: Any) -> bool:
    """Return whether a value has a shape.

    A shape is a type, a list with the shape of all its items, a tuple of alternative shapes, a
    mapping from keys to shapes, None or Any. A key that ends with ``?`` is optional. The key ``*``
    stands for every key. A bool does not count as an int.
    """
    if shape is Any:
        return True
    if isinstance(shape, tuple):
        return any(fits(value, alternative) for alternative in shape)
    if isinstance(shape, list):
        return isinstance(value, list) and all(fits(item, shape[0]) for item in value)
    if isinstance(shape, dict):
        return isinstance(value, dict) and _has_keys(value, shape)
    if shape is None or value is None:
        return value is shape
    return isinstance(value, shape) and (shape is bool or not isinstance(value, bool))


def _has_keys(value: dict[str, Any], shape: dict[str, Any]) -> bool:
    if "*" in shape:
        return all(fits(item, shape["*"]) for item in value.values())
    for name, inner in shape.items():
        key = name.rstrip("?")
        if key not in value and key == name:
            return False
        if key in value and not fits(value[key], inner):
            return False
    return True
