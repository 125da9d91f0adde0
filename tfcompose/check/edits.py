"""The one safe answer to findings of rules, as edits of the file: an optical frame gets the optical rotation."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from tfcompose.findings import Edit, Finding, Span

if TYPE_CHECKING:
    from collections.abc import Iterable

    from tfcompose.load import Path, Source

#: The optical rotation of REP-103 in each way to write a rotation.
_OPTICAL: dict[str, Any] = {
    "rpy": ["-90 deg", "0", "-90 deg"],
    "quat_xyzw": ["-0.5", "0.5", "-0.5", "0.5"],
    "matrix": [["0", "0", "1"], ["-1", "0", "0"], ["0", "-1", "0"]],
    "axis_angle": {"axis": ["-1", "1", "-1"], "angle": "120 deg"},
    "look": "forward",
}
_WRITTEN = "rpy: [-90 deg, 0, -90 deg]"

#: With these the pose beside them is not that of the frame in its parent.
_ELSEWHERE = ("relative_to", "place", "calibration")
_SECTIONS = ("frames", "links", "joints")


def with_edits(found: Iterable[Finding], source: Source) -> list[Finding]:
    """Return the findings; those about optical frames with the edits that turn them, where that is safe."""
    return [replace(one, edits=_turned(one, source)) if one.code == "TF401" else one for one in found]


def _turned(found: Finding, source: Source) -> tuple[Edit, ...]:
    entry = _entry(found.span, source)
    if entry is None or any(key in entry[1] for key in _ELSEWHERE):
        return ()
    path, data = entry
    written = [key for key in _OPTICAL if key in data]
    if not written:
        edits = [_insertion(path, data, source)]
    elif len(written) == 1:
        edits = _replaced(data[written[0]], _OPTICAL[written[0]], (*path, written[0]), source)
    else:
        return ()
    return tuple(edits) if all(_is_alone(edit.span, path, source) for edit in edits) else ()


def _entry(at: Span | None, source: Source) -> tuple[Path, dict[str, Any]] | None:
    """Return the only entry of the file whose parent stands at ``at``."""
    hits = [path for path, place in source.places.walk() if path[-1:] == ("parent",) and place.span == at]
    if len(hits) != 1 or len(hits[0]) != 3 or hits[0][0] not in _SECTIONS:  # noqa: PLR2004 (section, name, parent)
        return None
    section, name, _ = hits[0]
    data = source.data[str(section)][name]
    return (hits[0][:-1], data) if source.at(hits[0][:-1]).file == source.at(hits[0]).file else None


def _insertion(path: Path, data: dict[str, Any], source: Source) -> Edit:
    """Return the edit that writes the rotation behind the parent."""
    parent = source.at((*path, "parent"))
    first = min((source.at_key((*path, key)) for key in data), key=lambda span: (span.line, span.column))
    begin = source.at(path)
    if (begin.line, begin.column) < (first.line, first.column):  # in braces
        at = (parent.end_line, parent.end_column)
        return Edit(Span(parent.file, *at, *at), f", {_WRITTEN}")
    at = (parent.end_line + 1, 1)
    indent = " " * (source.at_key((*path, "parent")).column - 1)
    return Edit(Span(parent.file, *at, *at), f"{indent}{_WRITTEN}\n")


def _replaced(old: Any, new: Any, path: Path, source: Source) -> list[Edit]:
    """Return the edits that put each scalar of ``new`` where that of ``old`` stands; none where they differ in form."""
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
    """Whether the stretch belongs to this entry alone, and to no alias of it."""
    others = (other for other, place in source.places.walk() if other[: len(path)] != path and place.span == span)
    return next(others, None) is None
