"""Comments that tfcompose reads: ``# tfcompose: allow TF401 because …``.

A comment counts for its own line, or, alone on a line, for the next one.
"""

from __future__ import annotations

import re

from tfcompose.diagnostic import Allow, Span

_COMMENT = re.compile(r"#\s*tfcompose:\s*allow\b(?P<codes>[\sA-Z0-9,]*?)(?:\bbecause\b(?P<reason>[^#]*))?(?:#.*)?$")
_CODE = re.compile(r"[A-Z]+[0-9]+")


def allows_in(text: str, file: str) -> tuple[Allow, ...]:
    """Return the comments in a file's text."""
    found = []
    for number, line in enumerate(text.splitlines(), 1):
        match = _COMMENT.search(line) if "tfcompose:" in line else None
        if match:
            alone = not line[: match.start()].strip()
            at = Span(file, number, match.start() + 1, number, len(line) + 1)
            codes = tuple(_CODE.findall(match["codes"]))
            found.append(Allow(codes, number + alone, (match["reason"] or "").strip(), at))
    return tuple(found)
