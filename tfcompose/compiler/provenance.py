"""Provenance of an edge: the places of the values that determine it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from tfcompose.model.robot import Edge
    from tfcompose.spec.load import Path, Source

#: Keys that set the pose or the owner of an edge.
_KEYS = (
    *(
        "parent",
        "child",
        "type",
        "axis",
        "offset",
        "xyz",
        "rpy",
        "quat_xyzw",
        "axis_angle",
        "matrix",
        "look",
    ),
    *("relative_to", "place", "calibration", "owner", "rate", "static"),
)


def values_of(edge: Edge, sources: Sequence[Source]) -> list[str]:
    """Return a line for each value that determines the edge.

    A line has key, value, place, and the places of the values that this value replaced.
    ``sources`` are the sources of the robot and of its parts.
    """
    lines = []
    for source, path, value in _given_values(edge, sources):
        over = ", over ".join(str(old) for old in source.replaced.get(path, ()))
        place = f"{source.span_of(path)}, over {over}" if over else str(source.span_of(path))
        lines.append(f"{path[-1]}: {_show_value(value)}  {place}")
    return lines


def _given_values(edge: Edge, sources: Sequence[Source]) -> Iterator[tuple[Source, Path, Any]]:
    for source in sources:
        for entry in _entries(edge, source):
            data = source.mapping(*entry)
            if data and (source.span_of((*entry, "parent")) == edge.span or not edge.declared):
                yield from ((source, (*entry, key), data[key]) for key in _KEYS if key in data)
                return


def _entries(edge: Edge, source: Source) -> Iterator[Path]:
    """Yield the paths of entries that may define the edge.

    Entries of a part lack the prefix that the part's names have in the robot.
    """
    named = (
        {"joints": edge.joint_name, "sensors": edge.sensor}
        if edge.sensor
        else {"joints": edge.joint_name}
    )
    for section, name in (named | dict.fromkeys(("frames", "links", "parts"), edge.child)).items():
        entries = source.mapping(section)
        ends = (name[begin:] for begin in range(len(name) + 1))
        names = (
            sorted(entries, key=len, reverse=True)
            if section == "parts"
            else filter(entries.__contains__, ends)
        )
        for entry in names:
            yield (section, entry) if edge.declared else (section, entry, "frames", edge.child)


def _show_value(value: Any) -> str:
    if isinstance(value, dict):
        return f"{{{', '.join(f'{key}: {_show_value(item)}' for key, item in value.items())}}}"
    if isinstance(value, list):
        return f"[{', '.join(map(_show_value, value))}]"
    return str(value).lower() if isinstance(value, bool) else str(value)
