"""The numbers of poses and joint limits as the user wrote them.

A pose keeps a unit quaternion, and forgets whether somebody wrote 90, 1.57 or 90 deg. The rules about units and slips
of the pen need to know.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tfcompose.language.base import Spec
from tfcompose.model import AsWritten, Limit
from tfcompose.units import Written

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.language.robot import RobotSpec
    from tfcompose.load import Path, Source

_SECTIONS = ("frames", "links", "joints", "sensors", "parts", "processes")
_LISTS = frozenset({"xyz", "rpy", "quat_xyzw"})
_MAPPINGS = {
    "axis_angle": ("angle",),
    "look": ("up", "down", "left", "right", "roll"),
    "limit": ("lower", "upper"),
}


def as_written(spec: RobotSpec, source: Source) -> tuple[AsWritten, ...]:
    """Return the numbers of every pose and joint limit of the spec."""
    return tuple(
        found
        for section in _SECTIONS
        for name, entry in getattr(spec, section).items()
        for found in _of(entry, (section, name), source)
    )


def _of(spec: Spec, path: Path, source: Source) -> Iterator[AsWritten]:
    for key in spec.model_fields_set:
        value, here = getattr(spec, key), (*path, key)
        if key in _LISTS and value is not None:
            yield _numbers(dict(enumerate(value)), here, source)
        elif key in _MAPPINGS and isinstance(value, (Spec, Limit)):
            given = {step: getattr(value, step) for step in _MAPPINGS[key] if source.has((*here, step))}
            numbers = {step: number for step, number in given.items() if number is not None}
            if numbers:
                yield _numbers(numbers, here, source)
        elif isinstance(value, Spec):
            yield from _of(value, here, source)
        elif isinstance(value, (tuple, dict)) and key != "params":
            yield from _inside(value, here, source)


def _inside(value: Any, path: Path, source: Source) -> Iterator[AsWritten]:
    """Yield the numbers in a list or mapping; one item may stand for a list of it."""
    for step, item in value.items() if isinstance(value, dict) else enumerate(value):
        if isinstance(item, Spec):
            here = (*path, step)
            yield from _of(item, here if source.has(here) else path, source)


def _numbers(numbers: dict[Any, float], path: Path, source: Source) -> AsWritten:
    steps = list(numbers)
    values = tuple(numbers.values())
    with_unit = tuple(isinstance(value, Written) for value in values)
    return AsWritten(path, tuple(map(float, values)), with_unit, lambda index: source.at((*path, steps[index])))
