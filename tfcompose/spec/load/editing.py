"""Inserting values into YAML text.

A key into a mapping that is there, in the style of that mapping.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from tfcompose.foundation.findings import Edit, Span, apply_edits, line_starts
from tfcompose.spec.load import load

if TYPE_CHECKING:
    from collections.abc import Mapping

    from tfcompose.spec.load import Location, Path


def text_at(text: str, span: Span) -> str:
    """Return what stands at a span of the text."""
    begin, end = _offsets(text, span)
    return text[begin:end]


def _offsets(text: str, span: Span) -> tuple[int, int]:
    starts = [*line_starts(text), len(text)]
    return starts[span.line - 1] + span.column - 1, starts[span.end_line - 1] + span.end_column - 1


@dataclass(frozen=True, slots=True)
class MappingKeys:
    """The keys that stand in one mapping of a file's text, without those that ``<<`` brings."""

    text: str
    mapping: Location

    @property
    def own(self) -> list[str]:
        """The keys that stand in the mapping itself, in order."""
        inside = [
            name for name, key in self.mapping.keys.items() if self.mapping.span.holds(key.span)
        ]
        return sorted(inside, key=lambda name: self.mapping.keys[name].span[1:3])

    @property
    def is_flow(self) -> bool:
        """Whether it is a mapping in braces."""
        return "{" in text_at(self.text, self.mapping.span)[:1] or self._opening != -1

    @property
    def _opening(self) -> int:
        """Where the brace opens in the mapping's text, behind an anchor or a tag.

        −1: it is no flow mapping.
        """
        text = text_at(self.text, self.mapping.span)
        brace = text.find("{")
        tokens = text[:brace].split() if brace >= 0 else [""]
        return brace if all(token[:1] in {"&", "!"} for token in tokens) else -1

    def insertion(self, values: Mapping[str, str], after: tuple[str, ...] = ()) -> Edit:
        """Return the edit that adds keys after the last of the keys ``after`` that exists."""
        own = self.own
        known = [name for name in own if name in after] or [
            name for name in own if name in self.mapping.inside
        ]
        if self.is_flow:
            return self._in_braces(values, known[-1] if known else None, is_empty=not own)
        key = self.mapping.keys[known[-1] if known else own[-1]].span
        line = self._line_behind(known[-1]) if known else key.line
        lines = "".join(
            f"{' ' * (key.column - 1)}{name}: {value}\n" for name, value in values.items()
        )
        return Edit(Span(key.file, line, 1, line, 1), lines)

    def _in_braces(self, values: Mapping[str, str], behind: str | None, *, is_empty: bool) -> Edit:
        new = ", ".join(f"{name}: {value}" for name, value in values.items())
        span = self.mapping.span
        if behind is not None:
            at = self.mapping.inside[behind].span
            if span.holds(at):
                end = at.end_line, at.end_column
                return Edit(Span(span.file, *end, *end), f", {new}")
        begin, end_offset = _offsets(self.text, span)
        stripped = begin + len(self.text[begin : end_offset - 1].rstrip())
        starts = line_starts(self.text)
        line = max(index for index, start in enumerate(starts) if start <= stripped) + 1
        column = stripped - starts[line - 1] + 1
        return Edit(Span(span.file, line, column, line, column), new if is_empty else f", {new}")

    def _line_behind(self, name: str) -> int:
        """Return the line before which a new key can stand that comes behind the one of this name.

        A collection in block style ends where the next thing begins, behind comments; then it is
        the key's own line.
        """
        key, value = self.mapping.keys[name].span, self.mapping.inside[name].span
        is_alias = (value.line, value.column) < (
            key.line,
            key.column,
        ) or not self.mapping.span.holds(value)
        if is_alias:
            return key.line + 1
        return (
            value.end_line + 1 if value.end_column > 1 and value.end_line >= key.line else key.line
        )


def with_value(text: str, file: str, path: Path, values: Mapping[str, str | None]) -> str:
    """Return the text with YAML values in the mapping at ``path``, made if missing.

    Those that are there are replaced; None stands for ``null``, which removes the key in an
    overlay. The text is an overlay's, or empty.

    Raises:
        RejectedError: if the text is not YAML.
    """
    shown = {key: value for key, value in values.items() if value is not None}
    shown = {key: shown.get(key, "null") for key in values}
    if not any(line.strip() and not line.lstrip().startswith("#") for line in text.splitlines()):
        return text + _block(path, shown, 0)
    location, depth = load(text, file).places, 0
    while (
        depth < len(path)
        and (below := location.inside.get(path[depth])) is not None
        and below.keys
    ):
        location, depth = below, depth + 1
    keys = MappingKeys(text, location)
    there = [key for key in shown if key in location.inside] if depth == len(path) else []
    edits = [Edit(location.inside[key].span, shown[key]) for key in there]
    rest = {key: value for key, value in shown.items() if key not in there}
    if depth < len(path):
        rest = {str(path[depth]): _flow(path[depth + 1 :], shown)}
    if rest and depth < len(path) and not keys.is_flow:
        indent = location.keys[keys.own[0]].span.column - 1
        first = location.keys[keys.own[0]].span
        span = Span(file, first.line, 1, first.line, 1)
        if depth == 0:
            return _with_newline(text) + _block(path, shown, 0)
        edits.append(Edit(span, _block(path[depth:], shown, indent)))
    elif rest:
        edits.append(keys.insertion(rest))
    result = apply_edits(text, edits)
    return text if result is None else result


def _with_newline(text: str) -> str:
    return text if not text or text.endswith("\n") else f"{text}\n"


def _block(path: Path, values: Mapping[str, str], indent: int) -> str:
    lines = [f"{' ' * (indent + 2 * depth)}{step}:\n" for depth, step in enumerate(path)]
    inner = " " * (indent + 2 * len(path))
    return "".join([*lines, *(f"{inner}{key}: {value}\n" for key, value in values.items())])


def _flow(path: Path, values: Mapping[str, str]) -> str:
    text = "{" + ", ".join(f"{key}: {value}" for key, value in values.items()) + "}"
    for step in reversed(path):
        text = f"{{{step}: {text}}}"
    return text
