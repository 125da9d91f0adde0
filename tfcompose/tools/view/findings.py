"""Findings, and the result of a save, as HTML.

Texts are escaped, because they contain names from files and from other publishers.
"""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from tfcompose.foundation.findings import Finding
    from tfcompose.tools.view.session import Saved

#: The maximum number of findings in the panel.
MOST = 40
_ADDED, _REMOVED = "rgb(20, 130, 50)", "rgb(200, 40, 40)"
_COLOURS = {"error": "rgb(220, 30, 30)", "warning": "rgb(200, 120, 20)"}


def findings_html(findings: Sequence[Finding], none: str = "") -> str:
    """Return findings as lines of HTML, with red codes for errors.

    ``none`` is the text if there are no findings.
    """
    lines = [_line(finding) for finding in findings[:MOST]] or [escape(none)]
    return paragraphs(
        [*lines, *([f"and {len(findings) - MOST} more"] if len(findings) > MOST else [])]
    )


def _line(finding: Finding) -> str:
    place = f" ({escape(str(finding.span))})" if finding.span else ""
    colour = _COLOURS.get(finding.severity, "inherit")
    code = f'<span style="color: {colour}">{escape(finding.code)}</span>'
    return f"{code} {escape(finding.message)}{place}"


def paragraphs(lines: Sequence[str]) -> str:
    """Return HTML with each line as a paragraph that is as wide as the panel."""
    return (
        '<div style="padding: 0 0.7em; font-size: 0.85em; overflow-wrap:'
        f' anywhere">{"<br>".join(lines)}</div>'
    )


def format_saved(saved: Saved) -> str:
    """Return the result of a save as HTML: the diff, findings, and values for an overlay."""
    if saved.refused:
        return paragraphs(["not saved, there would be errors:"]) + findings_html(saved.refused)
    text = paragraphs(["saved:" if saved.diff else "nothing to save"])
    if saved.diff:
        text += _code([_diff_line(line) for line in saved.diff.splitlines()]) + findings_html(
            saved.findings
        )
    for place in saved.elsewhere:
        offer = _code(map(escape, place.overlay("", "").splitlines())) if place.entry else ""
        text += (
            paragraphs(
                [
                    f"{escape(place.reason)} ({escape(str(place.span))})"
                    + "; in an overlay:" * bool(offer)
                ]
            )
            + offer
        )
    return text


def _diff_line(line: str) -> str:
    colour = {"+": _ADDED, "-": _REMOVED}.get(line[:1], "inherit")
    return f'<span style="color: {colour}">{escape(line)}</span>'


def _code(lines: Iterable[str]) -> str:
    """Return lines of HTML in a fixed-width font; the panel wraps long lines."""
    style = (
        "margin: 0.3em 0.7em; font-size: 0.75em; white-space: pre-wrap; overflow-wrap: anywhere"
    )
    return f'<pre style="{style}">{chr(10).join(lines)}</pre>'
