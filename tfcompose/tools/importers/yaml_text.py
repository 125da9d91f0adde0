"""Separation of expressions of a robot file from other text with ``${``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tfcompose.foundation.yaml_text import Bare, entry
from tfcompose.tools.importers.texts import Argument, FileText, MadeFile, Text, parts_of, texts_in

if TYPE_CHECKING:
    from tfcompose.tools.importers.texts import Part


class ExpressionText(str):
    """A text that is an expression, written as ``${…}``."""

    __slots__ = ()


def without_expressions(
    sections: dict[str, dict[str, Any]],
) -> tuple[dict[str, dict[str, Any]], list[str]]:
    """Return the sections without unintended expressions, and the variables they need."""
    literals = (
        part
        for text in texts_in(sections)
        if not isinstance(text, ExpressionText)
        for part in parts_of(text)
        if isinstance(part, str)
    )
    lines = entry("vars", {"dollar": "$"}) if any("${" in part for part in literals) else []
    return _escape(sections), lines


def _escape(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _escape(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_escape(item) for item in value]
    if not isinstance(value, str):
        return value
    if isinstance(value, ExpressionText):
        return f"${{{value}}}"
    if isinstance(value, Text):
        return "".join(map(_escape_part, value.parts))
    text = value.replace("${", "${dollar}{")
    return Bare(f'"{text}"') if text != value and isinstance(value, Bare) else type(value)(text)


def _escape_part(part: Part) -> str:
    match part:
        case Argument(name=name):
            return f"${{args.{name}}}"
        case FileText(file=file):
            return file.replace("${", "${dollar}{")
        case MadeFile(file=file):
            return f"${{file({file})}}"
    return part.replace("${", "${dollar}{")
