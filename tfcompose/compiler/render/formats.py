"""Findings for programs: a JSON list, annotations of a GitHub workflow, SARIF, and JUnit XML."""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from tfcompose.compiler.render.text import no_address
from tfcompose.foundation.catalogue import CATALOGUE
from tfcompose.foundation.text import visible

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from tfcompose.compiler.render.text import CodeAddress
    from tfcompose.foundation.findings import Finding, Span


def render_json(findings: Sequence[Finding]) -> str:
    """Return the findings as a JSON list. The place of a finding without a span is null."""
    return (
        json.dumps([_entry(finding) for finding in findings], indent=2, ensure_ascii=False) + "\n"
    )


def _entry(finding: Finding) -> dict[str, Any]:
    end = (
        {"end_line": finding.span.end_line, "end_column": finding.span.end_column}
        if finding.span
        else {}
    )
    return {
        "code": finding.code,
        "name": finding.name,
        "severity": finding.severity,
        "message": finding.message,
        **_place(finding.span),
        **({"end_line": None, "end_column": None} | end),
        "help": finding.help,
        "notes": [{"message": note.message} | _place(note.span) for note in finding.notes],
    }


def _place(span: Span | None) -> dict[str, Any]:
    if span is None:
        return {"file": None, "line": None, "column": None}
    return {"file": span.file, "line": span.line, "column": span.column}


def render_github(findings: Sequence[Finding]) -> str:
    """Return the findings as GitHub workflow commands."""
    return "".join(_annotation(finding) for finding in findings)


def _annotation(finding: Finding) -> str:
    properties: dict[str, object] = {"title": finding.label}
    if finding.span:
        span = finding.span
        properties = {"file": span.file, "line": span.line, "col": span.column} | properties
        if span.end_line == span.line:
            properties["endColumn"] = span.end_column
    notes = [
        ": ".join(map(str, filter(None, (note.span, note.message)))) for note in finding.notes
    ]
    lines = [finding.message, *notes, *([f"help: {finding.help}"] if finding.help else [])]
    message = "\n".join(map(visible, lines))
    listed = ",".join(
        f"{name}={_escape_property(visible(str(value)))}" for name, value in properties.items()
    )
    return f"::{finding.severity} {listed}::{_escape(message)}\n"


def _escape(text: str) -> str:
    return text.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")


def _escape_property(text: str) -> str:
    return _escape(text).replace(":", "%3A").replace(",", "%2C")


SCHEMA = "https://json.schemastore.org/sarif-2.1.0.json"


def render_sarif(
    findings: Sequence[Finding], version: str, address_of: CodeAddress = no_address
) -> str:
    """Return the findings as a SARIF run, with the address of each code's page.

    ``address_of`` returns the URL of a code's page, or an empty string.
    """
    codes = sorted({finding.code for finding in findings})
    run = {
        "tool": {
            "driver": {
                "name": "tfcompose",
                "version": version,
                "rules": [_rule(code, address_of(code)) for code in codes],
            }
        },
        "columnKind": "unicodeCodePoints",
        "results": [_result(finding, codes.index(finding.code)) for finding in findings],
    }
    return (
        json.dumps(
            {"$schema": SCHEMA, "version": "2.1.0", "runs": [run]}, indent=2, ensure_ascii=False
        )
        + "\n"
    )


def _rule(code: str, address: str) -> dict[str, Any]:
    page = CATALOGUE.page(code)
    return {
        "id": code,
        "name": CATALOGUE[code].name,
        "shortDescription": {"text": CATALOGUE.summary(code)},
        "fullDescription": {"text": page},
        "help": {"text": page, "markdown": page},
    } | ({"helpUri": address} if address else {})


def _result(finding: Finding, index: int) -> dict[str, Any]:
    advice = f"\n{finding.help}" if finding.help else ""
    result: dict[str, Any] = {
        "ruleId": finding.code,
        "ruleIndex": index,
        "level": finding.severity,
        "message": {"text": f"{finding.message}{advice}"},
    }
    if finding.span:
        result["locations"] = [{"physicalLocation": _location(finding.span)}]
    related = [
        {"physicalLocation": _location(note.span), "message": {"text": note.message}}
        for note in finding.notes
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
    return {
        "artifactLocation": {"uri": quote(span.file, errors="surrogateescape")},
        "region": region,
    }


# XML 1.0 forbids these characters, even escaped.
_NOT_XML = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_XML_ESCAPES = {
    "&": "&amp;",
    "<": "&lt;",
    ">": "&gt;",
    '"': "&quot;",
    "\n": "&#10;",
    "\r": "&#13;",
    "\t": "&#9;",
}
_ESCAPED = re.compile('[&<>"\n\r\t]')


def render_junit(
    suite: str,
    cases: Iterable[tuple[str, str, tuple[Finding, ...]]],
    *,
    failing: frozenset[str],
    seconds: float,
) -> str:
    """Return a test suite. Each case is (group, name, findings).

    A case fails if a finding has one of the ``failing`` severities. The output of a case contains
    its other findings. ``seconds`` is the duration of the suite.
    """
    rows, failed, count = [], 0, 0
    for group, name, findings in cases:
        count += 1
        fatal = [finding for finding in findings if finding.severity in failing]
        failed += bool(fatal)
        body = "".join(
            f'    <failure type="{finding.code}"'
            f' message="{_xml(finding.message)}">{_xml(_details(finding))}</failure>\n'
            for finding in fatal[:1]
        )
        remaining = [*fatal[1:], *(finding for finding in findings if finding not in fatal)]
        if remaining:
            body += (
                f"    <system-out>{_xml(chr(10).join(map(_details, remaining)))}</system-out>\n"
            )
        head = f'  <testcase classname="{_xml(f"{suite}.{group}")}" name="{_xml(name)}" time="0"'
        rows.append(f"{head}>\n{body}  </testcase>\n" if body else f"{head}/>\n")
    counts = f'tests="{count}" failures="{failed}" errors="0" time="{seconds:.3f}"'
    return (
        f'<?xml version="1.0" encoding="UTF-8"?>\n<testsuites {counts}>\n'
        f'<testsuite name="{_xml(suite)}" {counts}>\n{"".join(rows)}</testsuite>\n</testsuites>\n'
    )


def _details(finding: Finding) -> str:
    where = f"{finding.span}: " if finding.span else ""
    lines = [
        f"{where}{finding.severity}[{finding.code}] {finding.message}",
        *(f"note: {note.message}" for note in finding.notes),
    ]
    return "\n".join([*lines, f"help: {finding.help}"] if finding.help else lines)


def _xml(text: str) -> str:
    return _ESCAPED.sub(lambda match: _XML_ESCAPES[match[0]], _NOT_XML.sub("?", text))
