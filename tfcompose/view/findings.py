"""Findings as HTML: names in them come from files, and from whoever publishes."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tfcompose.findings import Finding

#: So many are shown.
MOST = 40
_COLOURS = {"error": "rgb(220, 30, 30)", "warning": "rgb(200, 120, 20)"}


def findings_html(found: Sequence[Finding], none: str = "") -> str:
    """Return findings as lines of HTML, the codes of errors in red; ``none`` is what to say where there are none."""
    lines = [_line(one) for one in found[:MOST]] or [escape(none)]
    return paragraphs([*lines, *([f"and {len(found) - MOST} more"] if len(found) > MOST else [])])


def _line(one: Finding) -> str:
    place = f" ({escape(str(one.span))})" if one.span else ""
    colour = _COLOURS.get(one.severity, "inherit")
    return f'<span style="color: {colour}">{escape(one.code)}</span> {escape(one.message)}{place}'


def paragraphs(lines: Sequence[str]) -> str:
    """Return lines of HTML one below the other, as wide as the panel."""
    return f'<div style="padding: 0 0.7em; font-size: 0.85em; overflow-wrap: anywhere">{"<br>".join(lines)}</div>'
