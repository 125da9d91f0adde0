"""The numbers of poses and joint limits as they stand in the file.

A pose keeps a unit quaternion, and forgets whether somebody wrote 90, 1.57 or 90 deg. The rules about units and slips
of the pen need to know.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tfcompose.model import AsWritten
from tfcompose.validate.quantity import NUMBER, Quantity, UnitError, quantity

if TYPE_CHECKING:
    from collections.abc import Iterable

    from tfcompose.load import Path, Source

_HOLDERS = frozenset({dict, list})
_SECTIONS = ("frames", "links", "joints", "sensors", "parts", "processes")

#: Keys whose values are numbers of a pose or a limit.
_LISTS = frozenset({"xyz", "rpy", "quat_xyzw"})
_MAPPINGS = {
    "axis_angle": ("angle",),
    "look": ("up", "down", "left", "right", "roll"),
    "limit": ("lower", "upper"),
}
#: Keys below which other languages stand, and no poses.
_OPAQUE = frozenset({"params", "options", "env", "remap", "run", "after", "material", "inertia", "vars"})


def as_written(data: dict[str, Any], source: Source) -> tuple[AsWritten, ...]:
    """Return the numbers of every pose and joint limit in ``data``, in which expressions have been computed."""
    found: list[AsWritten] = []
    for section in _SECTIONS:
        entries = data.get(section)
        for name, entry in entries.items() if isinstance(entries, dict) else ():
            _walk(entry, (section, name), source, found)
    return tuple(found)


def _walk(value: Any, path: Path, source: Source, found: list[AsWritten]) -> None:
    for key, item in value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ():
        if type(item) not in _HOLDERS:  # most are numbers and texts
            continue
        if key in _LISTS and isinstance(item, list):
            _take(item, range(len(item)), (*path, key), source, found)
        elif key in _MAPPINGS and isinstance(item, dict):
            _take(item, [step for step in _MAPPINGS[str(key)] if step in item], (*path, key), source, found)
        elif key not in _OPAQUE:
            _walk(item, (*path, key), source, found)


def _take(item: Any, steps: Iterable[str | int], path: Path, source: Source, found: list[AsWritten]) -> None:
    """Take the numbers at the steps of a list or mapping."""
    numbers: list[float] = []
    units: list[bool] = []
    kept: list[str | int] = []
    for step in steps:
        number: Any = item[step]
        if type(number) is float or type(number) is int:  # as most are
            numbers.append(float(number))
            units.append(False)
            kept.append(step)
            continue
        with_unit = False
        if isinstance(number, str):
            try:
                number = quantity(number)
            except UnitError:
                continue
        if isinstance(number, Quantity):
            number, with_unit = number.value, number.dimension != NUMBER
        if isinstance(number, (int, float)) and not isinstance(number, bool):
            numbers.append(float(number))
            units.append(with_unit)
            kept.append(step)
    if numbers:
        found.append(AsWritten(path, tuple(numbers), tuple(units), lambda index: source.at((*path, kept[index]))))
