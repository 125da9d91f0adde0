"""Findings for people: the place, the source line with a caret, notes and help."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import TYPE_CHECKING

from tfcompose.foundation.text import mask_invisible, plural, visible

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tfcompose.foundation.findings import Finding, Span

RED, YELLOW, BLUE, GREEN, BOLD, PLAIN = (
    "\033[31m",
    "\033[33m",
    "\033[34m",
    "\033[32m",
    "\033[1m",
    "\033[0m",
)

_LONGEST_LINE = 160
_LONGEST_MESSAGE = 1000


#: Returns the address of a code's page, or an empty string.
CodeAddress = Callable[[str], str]


def no_address(code: str) -> str:
    """Return an empty address for any code."""
    del code
    return ""


def render_text(
    findings: Sequence[Finding],
    line_of: Callable[[str, int], str | None],
    *,
    colour: bool,
    address_of: CodeAddress = no_address,
) -> str:
    """Return the findings as text.

    ``line_of`` returns a line of a file, numbered from 1, or None for an unreadable file. A code
    with an address becomes a link (OSC 8).
    """
    paint = _Paint(address_of, colour=colour)
    return "".join(_format_finding(finding, line_of, paint) for finding in findings)


class _Paint:
    def __init__(self, address_of: CodeAddress, *, colour: bool) -> None:
        self._address_of = address_of
        self.colour = colour

    def __call__(self, text: str, *codes: str) -> str:
        return f"{''.join(codes)}{text}{PLAIN}" if self.colour else text

    def link(self, code: str) -> str:
        address = self._address_of(code)
        return f"\033]8;;{address}\033\\{code}\033]8;;\033\\" if address else code


def _format_finding(
    finding: Finding, line_of: Callable[[str, int], str | None], paint: _Paint
) -> str:
    shade = RED if finding.severity == "error" else YELLOW
    place = _printable(f"{finding.span}: ") if finding.span else ""
    message = _printable(finding.message)
    head = (
        f"{paint(place, BOLD)}"
        f"{paint(f'{finding.severity}[{paint.link(finding.code)}]', shade, BOLD)}"
        f" {paint(message, BOLD)}"
    )
    lines = [head]
    if finding.span:
        lines += _excerpt(finding.span, line_of, paint, shade)
    for note in finding.notes:
        location = f"{note.span}: " if note.span else ""
        lines.append(f"   {paint('note', BLUE)}: {_printable(location + note.message)}")
    if finding.help:
        lines.append(f"   {paint('help', GREEN)}: {_printable(finding.help)}")
    return "\n".join(lines) + "\n"


def _printable(text: str) -> str:
    """Return the text as a line of limited length without control characters."""
    shortened = text if len(text) <= _LONGEST_MESSAGE else f"{text[:_LONGEST_MESSAGE]}…"
    return visible(shortened)


def _excerpt(
    span: Span, line_of: Callable[[str, int], str | None], paint: _Paint, shade: str
) -> list[str]:
    line = line_of(span.file, span.line)
    if line is None or not line.strip():
        return []
    start = span.column - 1
    end = span.end_column - 1 if span.end_line == span.line else len(line.rstrip())
    line_text, skipped = line, max(0, start - _LONGEST_LINE // 2)
    if len(line) > _LONGEST_LINE:
        line_text = line[skipped : skipped + _LONGEST_LINE]
    else:
        skipped = 0
    width = max(1, min(end, skipped + len(line_text)) - start)
    lead = re.sub(r"[^\t]", " ", line_text[: start - skipped])
    line_text = mask_invisible(line_text.rstrip(), "?", kept="\t")
    return [f"{span.line:>5} | {line_text}", f"      | {lead}{paint('^' * width, shade, BOLD)}"]


def summary(findings: Sequence[Finding], files: int, *, warnings_fail: bool = False) -> str:
    """Return the last line: the numbers of findings and files.

    If there are only warnings and they do not fail the command, the line says so.
    """
    errors = sum(finding.severity == "error" for finding in findings)
    warnings = len(findings) - errors
    where = f"in {plural(files, 'file')}"
    if not findings:
        return f"no findings {where}\n"
    parts = [plural(n, noun) for n, noun in ((errors, "error"), (warnings, "warning")) if n]
    exits = "" if errors or warnings_fail else " (exit code 0; --fail-on warning makes it 1)"
    return f"{' and '.join(parts)} {where}{exits}\n"
