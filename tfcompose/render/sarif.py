"""Findings as SARIF 2.1.0 (OASIS), which code scanning services read."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from tfcompose.catalogue import CATALOGUE

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from tfcompose.findings import Finding, Span

SCHEMA = "https://json.schemastore.org/sarif-2.1.0.json"


def render_sarif(found: Sequence[Finding], version: str, pages: Mapping[str, str]) -> str:
    """Return the findings as one run of tfcompose; ``pages`` holds the page of each code."""
    codes = sorted({one.code for one in found})
    run = {
        "tool": {"driver": {"name": "tfcompose", "version": version, "rules": [_rule(code, pages) for code in codes]}},
        "columnKind": "unicodeCodePoints",
        "results": [_result(one, codes.index(one.code)) for one in found],
    }
    return json.dumps({"$schema": SCHEMA, "version": "2.1.0", "runs": [run]}, indent=2, ensure_ascii=False) + "\n"


def _rule(code: str, pages: Mapping[str, str]) -> dict[str, Any]:
    rule: dict[str, Any] = {"id": code, "name": CATALOGUE[code].name}
    page = pages.get(code, "")
    if page:
        rule["shortDescription"] = {"text": page.partition("\n")[0]}
        rule["fullDescription"] = {"text": page}
    return rule


def _result(found: Finding, index: int) -> dict[str, Any]:
    advice = f"\n{found.help}" if found.help else ""
    result: dict[str, Any] = {
        "ruleId": found.code,
        "ruleIndex": index,
        "level": found.severity,
        "message": {"text": f"{found.message}{advice}"},
    }
    if found.span:
        result["locations"] = [{"physicalLocation": _location(found.span)}]
    related = [
        {"physicalLocation": _location(note.span), "message": {"text": note.message}}
        for note in found.notes
        if note.span
    ]
    return result | ({"relatedLocations": related} if related else {})


def _location(span: Span) -> dict[str, Any]:
    region = {
        "startLine": span.line,
        "startColumn": span.column,
        "endLine": span.end_line,
        "endColumn": span.end_column,
    }
    return {"artifactLocation": {"uri": quote(span.file, errors="surrogateescape")}, "region": region}
