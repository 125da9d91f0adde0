"""Findings as JUnit's XML, which CI servers show: a suite, and a case for each thing that was checked."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable

    from tfcompose.findings import Finding

# XML 1.0 has no place for these, not even escaped.
_NOT_XML = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_ESCAPES = {"&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;", "\n": "&#10;", "\r": "&#13;", "\t": "&#9;"}
_CHARACTER = re.compile('[&<>"\n\r\t]')


def render_junit(
    suite: str, cases: Iterable[tuple[str, str, tuple[Finding, ...]]], *, failing: frozenset[str], seconds: float
) -> str:
    """Return a test suite of cases (group, name, findings); one fails if a finding has a ``failing`` severity.

    The other findings are in its output.
    """
    rows, failed, count = [], 0, 0
    for group, name, found in cases:
        count += 1
        fatal = [one for one in found if one.severity in failing]
        failed += bool(fatal)
        body = "".join(
            f'    <failure type="{one.code}" message="{_xml(one.message)}">{_xml(_text(one))}</failure>\n'
            for one in fatal[:1]
        )
        others = [*fatal[1:], *(one for one in found if one not in fatal)]
        if others:
            body += f"    <system-out>{_xml(chr(10).join(map(_text, others)))}</system-out>\n"
        head = f'  <testcase classname="{_xml(f"{suite}.{group}")}" name="{_xml(name)}" time="0"'
        rows.append(f"{head}>\n{body}  </testcase>\n" if body else f"{head}/>\n")
    counts = f'tests="{count}" failures="{failed}" errors="0" time="{seconds:.3f}"'
    return (
        f'<?xml version="1.0" encoding="UTF-8"?>\n<testsuites {counts}>\n'
        f'<testsuite name="{_xml(suite)}" {counts}>\n{"".join(rows)}</testsuite>\n</testsuites>\n'
    )


def _text(found: Finding) -> str:
    where = f"{found.span}: " if found.span else ""
    lines = [
        f"{where}{found.severity}[{found.code}] {found.message}",
        *(f"note: {note.message}" for note in found.notes),
    ]
    return "\n".join([*lines, f"help: {found.help}"] if found.help else lines)


def _xml(text: str) -> str:
    return _CHARACTER.sub(lambda match: _ESCAPES[match[0]], _NOT_XML.sub("?", text))
