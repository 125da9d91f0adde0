"""Insertion of values into YAML text.

A key is inserted into an existing mapping, in the style of that mapping.
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
    """Return the text at a span."""
    begin, end = _offsets(text, span)
    return text[begin:end]


def _offsets(text: str, span: Span) -> tuple[int, int]:
    starts = [*line_starts(text), len(text)]
    return starts[span.line - 1] + span.column - 1, starts[span.end_line - 1] + span.end_column - 1


@dataclass(frozen=True, slots=True)
class MappingKeys:
    """The keys of a mapping in a file's text, without keys that ``<<`` adds."""

    text: str
    mapping: Location

    @property
    def own_keys(self) -> list[str]:
        """The keys in the mapping itself, in order."""
        inside = [
            name for name, key in self.mapping.keys.items() if self.mapping.span.holds(key.span)
        ]
        return sorted(inside, key=lambda name: self.mapping.keys[name].span[1:3])

    @property
    def is_flow(self) -> bool:
        """Whether the mapping is in braces."""
        return "{" in text_at(self.text, self.mapping.span)[:1] or self._opening != -1

    @property
    def _opening(self) -> int:
        """The index of the opening brace in the mapping's text, after an anchor or a tag.

        -1 if the mapping is not in braces.
        """
        text = text_at(self.text, self.mapping.span)
        brace = text.find("{")
        tokens = text[:brace].split() if brace >= 0 else [""]
        return brace if all(token[:1] in {"&", "!"} for token in tokens) else -1

    def insertion(self, values: Mapping[str, str], after: tuple[str, ...] = ()) -> Edit:
        """Return the edit that inserts keys after the last existing key among ``after``."""
        keys = self.own_keys
        neighbours = [name for name in keys if name in after] or [
            name for name in keys if name in self.mapping.inside
        ]
        if self.is_flow:
            return self._in_braces(
                values, neighbours[-1] if neighbours else None, is_empty=not keys
            )
        key = self.mapping.keys[neighbours[-1] if neighbours else keys[-1]].span
        line = self._line_behind(neighbours[-1]) if neighbours else key.line
        lines = "".join(
            f"{' ' * (key.column - 1)}{name}: {value}\n" for name, value in values.items()
        )
        return Edit(Span(key.file, line, 1, line, 1), lines)

    def _in_braces(self, values: Mapping[str, str], behind: str | None, *, is_empty: bool) -> Edit:
        new = ", ".join(f"{name}: {value}" for name, value in values.items())
        span = self.mapping.span
        if behind is not None:
            before = self.mapping.inside[behind].span
            if span.holds(before):
                end = before.end_line, before.end_column
                return Edit(Span(span.file, *end, *end), f", {new}")
        begin, end_offset = _offsets(self.text, span)
        stripped = begin + len(self.text[begin : end_offset - 1].rstrip())
        starts = line_starts(self.text)
        line = max(index for index, start in enumerate(starts) if start <= stripped) + 1
        column = stripped - starts[line - 1] + 1
        return Edit(Span(span.file, line, column, line, column), new if is_empty else f", {new}")

    def _line_behind(self, name: str) -> int:
        """Return the line before which to insert a new key after the key ``name``.

        A block-style collection ends where the next item begins, after comments. In that case,
        return the line of the key itself.
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
    """Return the text with YAML values set in the mapping at ``path``.

    The mapping is created if it is missing. Existing values are replaced. None is written as
    ``null``, which removes the key in an overlay. ``text`` is the text of an overlay, or empty.

    Raises:
        RejectedError: if the text is not YAML.
    """
    items = {key: value for key, value in values.items() if value is not None}
    items = {key: items.get(key, "null") for key in values}
    if not any(line.strip() and not line.lstrip().startswith("#") for line in text.splitlines()):
        return text + _block(path, items, 0)
    location, depth = load(text, file).places, 0
    while (
        depth < len(path)
        and (below := location.inside.get(path[depth])) is not None
        and below.keys
    ):
        location, depth = below, depth + 1
    keys = MappingKeys(text, location)
    existing = [key for key in items if key in location.inside] if depth == len(path) else []
    edits = [Edit(location.inside[key].span, items[key]) for key in existing]
    rest = {key: value for key, value in items.items() if key not in existing}
    if depth < len(path):
        rest = {str(path[depth]): _flow(path[depth + 1 :], items)}
    if rest and depth < len(path) and not keys.is_flow:
        indent = location.keys[keys.own_keys[0]].span.column - 1
        first = location.keys[keys.own_keys[0]].span
        span = Span(file, first.line, 1, first.line, 1)
        if depth == 0:
            return _with_newline(text) + _block(path, items, 0)
        edits.append(Edit(span, _block(path[depth:], items, indent)))
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
