"""Findings as annotations of a GitHub workflow: one ``::error`` or ``::warning`` command a line.

The escapes are those of the workflow commands' documentation: per cent, carriage return and line feed in a message, and
colon and comma as well in a property.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tfcompose.findings import Finding


def render_github(found: Sequence[Finding]) -> str:
    """Return the findings as workflow commands."""
    return "".join(_one(one) for one in found)


def _one(found: Finding) -> str:
    properties: dict[str, object] = {"title": f"{found.code} {found.name}"}
    if found.span:
        at = found.span
        properties = {"file": at.file, "line": at.line, "col": at.column} | properties
        if at.end_line == at.line:
            properties["endColumn"] = at.end_column
    notes = [f"{note.span}: {note.message}" if note.span else note.message for note in found.notes]
    message = "\n".join([found.message, *notes, *([f"help: {found.help}"] if found.help else [])])
    listed = ",".join(f"{name}={_property(str(value))}" for name, value in properties.items())
    return f"::{found.severity} {listed}::{_message(message)}\n"


def _message(text: str) -> str:
    return text.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")


def _property(text: str) -> str:
    return _message(text).replace(":", "%3A").replace(",", "%2C")
