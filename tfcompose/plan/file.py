"""The plan as a file: JSON, written and read with the standard library alone."""

from __future__ import annotations

import json
from typing import Any

from tfcompose.findings import Finding, RejectedError, Span, finding
from tfcompose.plan import VERSION, Plan
from tfcompose.plan.codec import DecodeError, decode, encode, shown


def write_plan(plan: Plan) -> str:
    """Return the plan as JSON text: one line an edge and a process, the same bytes for the same plan."""
    lines = (
        f"  {_json(key)}: {_rows(value) if isinstance(value, list) else _json(value)}"
        for key, value in encode(plan).items()
    )
    return "{\n" + ",\n".join(lines) + "\n}\n"


def read_plan(text: str, file: str) -> Plan:
    """Return the plan that ``write_plan`` wrote.

    Raises:
        RejectedError: with a TF902 finding, if the text is no plan of this version.
    """
    try:
        data = json.loads(text)
    except (ValueError, RecursionError) as error:
        line, column = getattr(error, "lineno", 1), getattr(error, "colno", 1)
        raise RejectedError([_bad(f"not a plan: {error}", Span(file, line, column, line, column + 1))]) from None
    if not isinstance(data, dict) or "edges" not in data or "processes" not in data:
        raise RejectedError([_bad("not a plan: it has no edges and processes", Span(file))])
    if data.get("version") != VERSION or data["version"] is True:
        message = f"the plan has version {shown(data.get('version'))}; this tfcompose reads version {VERSION}"
        raise RejectedError([_bad(message, Span(file))])
    try:
        return decode(Plan, data)
    except DecodeError as error:
        raise RejectedError([_bad(f"not a valid plan: {error}", Span(file))]) from None


def _bad(message: str, span: Span) -> Finding:
    return finding("TF902", message, span, help="build it again: tfcompose build robot.yaml")


_json = json.JSONEncoder(ensure_ascii=False, allow_nan=False).encode


def _rows(rows: list[Any]) -> str:
    return "[\n" + ",\n".join(f"    {_json(row)}" for row in rows) + "\n  ]" if rows else "[]"
