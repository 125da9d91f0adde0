"""Values out of a plan's JSON, each of the kind that is expected; what is not raises and says where."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable

T = TypeVar("T")


def there(data: dict[str, Any], key: str, where: str) -> Any:
    """Return the value of a key.

    Raises:
        ValueError: if it is not there.
    """
    if key not in data:
        raise ValueError(f"{where}: {key} is missing")
    return data[key]


def rows(data: dict[str, Any], key: str, read: Callable[[dict[str, Any], str], T]) -> tuple[T, ...]:
    """Return what ``read`` makes of a list of mappings; each is named by its place in the list, counted from 1.

    Raises:
        TypeError, ValueError: if it is not there, or is something else.
    """
    made = []
    for number, row in enumerate(get(data, key, list, "plan"), 1):
        if not isinstance(row, dict):
            raise TypeError(f"{key} {number} is {row!r}, not a mapping")
        made.append(read(row, f"{key} {number}"))
    return tuple(made)


def get(data: dict[str, Any], key: str, kind: type[T], where: str) -> T:
    """Return the value of a key of that kind; a whole number may stand for a float, which is finite.

    Raises:
        TypeError, ValueError: if it is not there, or is something else.
    """
    value = there(data, key, where)
    if kind is float and isinstance(value, int) and not isinstance(value, bool):
        value = float(value)
    if not isinstance(value, kind) or (kind is int and isinstance(value, bool)):
        raise TypeError(f"{where}: {key} is {value!r}, not a {kind.__name__}")
    if isinstance(value, float) and not math.isfinite(value):
        raise ValueError(f"{where}: {key} is not finite")
    return value


def one_of(data: dict[str, Any], key: str, allowed: tuple[str | None, ...], where: str) -> Any:
    """Return the value of a key that is one of those allowed.

    Raises:
        TypeError, ValueError: if it is not there, or is something else.
    """
    if there(data, key, where) not in allowed:
        raise ValueError(f"{where}: {key} is {data[key]!r}, not one of {', '.join(str(one) for one in allowed)}")
    return data[key]


def optional(data: dict[str, Any], key: str, kind: type[T], where: str) -> T | None:
    """Return the value of a key of that kind, or None if it is null.

    Raises:
        TypeError, ValueError: if it is not there, or is something else.
    """
    return None if there(data, key, where) is None else get(data, key, kind, where)


def floats(data: dict[str, Any], key: str, count: int, where: str) -> tuple[float, ...]:
    """Return a list of ``count`` finite numbers.

    Raises:
        TypeError, ValueError: if it is not there, or is something else.
    """
    values = get(data, key, list, where)
    if len(values) != count or not all(type(v) in (int, float) and math.isfinite(v) for v in values):
        raise ValueError(f"{where}: {key} is not {count} finite numbers")
    return tuple(float(value) for value in values)


def texts(data: dict[str, Any], key: str, where: str) -> dict[str, str]:
    """Return a mapping of texts.

    Raises:
        TypeError, ValueError: if it is not there, or is something else.
    """
    values = get(data, key, dict, where)
    if not all(isinstance(value, str) for value in values.values()):
        raise TypeError(f"{where}: {key} holds something that is no text")
    return values


def strings(data: dict[str, Any], key: str, where: str) -> tuple[str, ...]:
    """Return a list of texts.

    Raises:
        TypeError, ValueError: if it is not there, or is something else.
    """
    return tuple(_string(value, f"{where}: {key}") for value in get(data, key, list, where))


def pairs(data: dict[str, Any], key: str, where: str) -> tuple[tuple[str, str], ...]:
    """Return a list of pairs of texts.

    Raises:
        TypeError, ValueError: if it is not there, or is something else.
    """
    made = []
    for value in get(data, key, list, where):
        if not isinstance(value, list) or len(value) != 2:  # noqa: PLR2004 (a pair)
            raise TypeError(f"{where}: {key} holds {value!r}, which is no pair")
        first, second = value
        made.append((_string(first, f"{where}: {key}"), _string(second, f"{where}: {key}")))
    return tuple(made)


def _string(value: object, where: str) -> str:
    if not isinstance(value, str):
        raise TypeError(f"{where} holds {value!r}, which is no text")
    return value
