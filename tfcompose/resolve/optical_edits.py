"""Edits of a robot file that give an entry the optical rotation of REP-103, in whichever way a rotation is written."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tfcompose.findings import Edit, Span

if TYPE_CHECKING:
    from tfcompose.load import Path, Source

_OPTICAL: dict[str, Any] = {
    "rpy": ["-90 deg", "0", "-90 deg"],
    "quat_xyzw": ["-0.5", "0.5", "-0.5", "0.5"],
    "matrix": [["0", "0", "1"], ["-1", "0", "0"], ["0", "-1", "0"]],
    "axis_angle": {"axis": ["-1", "1", "-1"], "angle": "120 deg"},
    "look": "forward",
}
_RPY = "rpy: [-90 deg, 0, -90 deg]"

#: With these the written pose is not that of the frame in its parent.
_OTHER_POSES = ("relative_to", "place", "calibration")
_SECTIONS = ("frames", "links", "joints")


def optical_edits(path: Path, source: Source) -> tuple[Edit, ...]:
    """Return the edits that turn the frame of the entry at ``path``, or none where that would change something else."""
    if path[0] not in _SECTIONS or source.at(path).file != source.at((*path, "parent")).file:
        return ()
    entry = source.data[str(path[0])][path[1]]
    rotations = [key for key in _OPTICAL if key in entry]
    if len(rotations) > 1 or any(key in entry for key in _OTHER_POSES):
        return ()
    if rotations:
        key = rotations[0]
        edits = _replaced(entry[key], _OPTICAL[key], (*path, key), source)
    else:
        edits = [_insertion(path, entry, source)]
    spans = [source.at((*path, "parent")), *(edit.span for edit in edits)]
    return tuple(edits) if all(_is_alone(span, path, source) for span in spans) else ()


def _insertion(path: Path, entry: dict[str, Any], source: Source) -> Edit:
    """Return the edit that writes the rotation after the parent."""
    parent = source.at((*path, "parent"))
    first = min((source.at_key((*path, key)) for key in entry), key=lambda span: (span.line, span.column))
    begin = source.at(path)
    if (begin.line, begin.column) < (first.line, first.column):  # in braces
        at = (parent.end_line, parent.end_column)
        return Edit(Span(parent.file, *at, *at), f", {_RPY}")
    at = (parent.end_line + 1, 1)
    indent = " " * (source.at_key((*path, "parent")).column - 1)
    return Edit(Span(parent.file, *at, *at), f"{indent}{_RPY}\n")


def _replaced(old: Any, new: Any, path: Path, source: Source) -> list[Edit]:
    """Return the edits that put each scalar of ``new`` in the place of that of ``old``; none where the forms differ."""
    steps = new.items() if isinstance(new, dict) else enumerate(new) if isinstance(new, list) else None
    if steps is None:
        return [] if isinstance(old, (dict, list)) or str(old) == new else [Edit(source.at(path), new)]
    same = (
        isinstance(old, type(new)) and len(old) == len(new) and all(not isinstance(old, dict) or k in old for k in new)
    )
    if not same:
        return []
    return [edit for step, item in steps for edit in _replaced(old[step], item, (*path, step), source)]


def _is_alone(span: Span, path: Path, source: Source) -> bool:
    """Whether what is at the span belongs to this entry alone, and to no alias of it."""
    others = (other for other, place in source.places.walk() if other[: len(path)] != path and place.span == span)
    return next(others, None) is None
