"""Findings for programs: a JSON list."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tfcompose.findings import Finding, Span


def render_json(found: Sequence[Finding]) -> str:
    """Return the findings as a JSON list; a place that is not known is null."""
    return json.dumps([_one(one) for one in found], indent=2, ensure_ascii=False) + "\n"


def _one(found: Finding) -> dict[str, Any]:
    end = {"end_line": found.span.end_line, "end_column": found.span.end_column} if found.span else {}
    return {
        "code": found.code,
        "name": found.name,
        "severity": found.severity,
        "message": found.message,
        **_place(found.span),
        **({"end_line": None, "end_column": None} | end),
        "help": found.help,
        "notes": [{"message": note.message} | _place(note.span) for note in found.notes],
    }


def _place(span: Span | None) -> dict[str, Any]:
    if span is None:
        return {"file": None, "line": None, "column": None}
    return {"file": span.file, "line": span.line, "column": span.column}
