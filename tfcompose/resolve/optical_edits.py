"""Edits of a robot file that give an entry the optical rotation of REP-103, in whichever way a rotation is written."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tfcompose.findings import Edit, Span
from tfcompose.units import quantity

if TYPE_CHECKING:
    from tfcompose.language.pose import EdgeKeys
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


def optical_edits(path: Path, keys: EdgeKeys, source: Source) -> tuple[Edit, ...]:
    """Return the edits that turn the frame of the entry at ``path``, or none where that would change something else."""
    if path[0] not in _SECTIONS or source.at(path).file != source.at((*path, "parent")).file:
        return ()
    rotations = [key for key in _OPTICAL if source.has_key((*path, key))]
    if len(rotations) > 1 or any(source.has_key((*path, key)) for key in _OTHER_POSES):
        return ()
    if rotations:
        key = rotations[0]
        edits = _replaced(getattr(keys, key), _OPTICAL[key], (*path, key), source)
    else:
        edits = [_insertion(path, source)]
    spans = [source.at((*path, "parent")), *(edit.span for edit in edits)]
    return tuple(edits) if all(_is_alone(span, path, source) for span in spans) else ()


def _insertion(path: Path, source: Source) -> Edit:
    """Return the edit that writes the rotation after the parent."""
    parent, entry = source.at((*path, "parent")), source.places.nearest(path)
    first = min((key.span for key in entry.keys.values()), key=lambda span: (span.line, span.column))
    if (entry.span.line, entry.span.column) < (first.line, first.column):  # in braces
        at = (parent.end_line, parent.end_column)
        return Edit(Span(parent.file, *at, *at), f", {_RPY}")
    at = (parent.end_line + 1, 1)
    indent = " " * (source.at_key((*path, "parent")).column - 1)
    return Edit(Span(parent.file, *at, *at), f"{indent}{_RPY}\n")


def _replaced(old: Any, new: Any, path: Path, source: Source) -> list[Edit]:
    """Return the edits that put each scalar of ``new`` in the place of that of ``old``; none where the forms differ."""
    if isinstance(new, dict):
        return [
            edit for key, item in new.items() for edit in _replaced(getattr(old, key, None), item, (*path, key), source)
        ]
    if isinstance(new, list):
        pairs = zip(old, new, strict=True) if isinstance(old, tuple) else ()
        return [edit for index, pair in enumerate(pairs) for edit in _replaced(*pair, (*path, index), source)]
    is_same = old == (new if isinstance(old, str) else quantity(new).value)
    return [Edit(source.at(path), new)] if isinstance(old, (str, float)) and not is_same else []


def _is_alone(span: Span, path: Path, source: Source) -> bool:
    """Whether what is at the span belongs to this entry alone, and to no alias of it."""
    others = (other for other, place in source.places.walk() if other[: len(path)] != path and place.span == span)
    return next(others, None) is None
