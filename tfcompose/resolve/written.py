"""The numbers of poses and joint limits as they stand in the file.

A pose keeps a unit quaternion, and forgets whether somebody wrote 90, 1.57 or 90 deg. The rules about units and slips
of the pen need to know.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tfcompose.model import AsWritten
from tfcompose.validate.quantity import NUMBER, Quantity, UnitError, quantity

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.load import Path, Source

_SECTIONS = ("frames", "links", "joints", "sensors", "processes")

#: Keys whose values are numbers of a pose or a limit.
_LISTS = frozenset({"xyz", "rpy", "quat_xyzw"})
_MAPPINGS = {
    "axis_angle": ("angle",),
    "look": ("up", "down", "left", "right", "roll"),
    "limit": ("lower", "upper"),
}
#: Keys below which other languages stand, and no poses.
_OPAQUE = frozenset({"params", "options", "env", "remap", "run", "after", "material", "inertia"})


def as_written(data: dict[str, Any], source: Source) -> tuple[AsWritten, ...]:
    """Return the numbers of every pose and joint limit in ``data``, in which expressions have been computed."""
    found: list[AsWritten] = []
    for section in _SECTIONS:
        entries = data.get(section)
        for name, entry in entries.items() if isinstance(entries, dict) else ():
            found += _walk(entry, (section, name), source)
    return tuple(found)


def _walk(value: Any, path: Path, source: Source) -> Iterator[AsWritten]:
    for key, item in value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ():
        at = (*path, key)
        steps: tuple[str | int, ...] = ()
        if key in _LISTS and isinstance(item, list):
            steps = tuple(range(len(item)))
        elif key in _MAPPINGS and isinstance(item, dict):
            steps = tuple(step for step in _MAPPINGS[str(key)] if step in item)
        numbers = [(step, number) for step in steps if (number := _number(item[step]))]
        if numbers:
            values, units = zip(*(number for _, number in numbers), strict=True)
            yield AsWritten(at, values, units, tuple(source.at((*at, step)) for step, _ in numbers))
        elif key not in _OPAQUE and isinstance(item, (dict, list)):
            yield from _walk(item, at, source)


def _number(value: Any) -> tuple[float, bool] | None:
    """Return the number in SI and whether it has a unit, or None where it is none."""
    if isinstance(value, str):
        try:
            value = quantity(value)
        except UnitError:
            return None
    if isinstance(value, Quantity):
        return value.value, value.dimension != NUMBER
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return None
    return float(value), False
