"""Comments that tfcompose reads: ``# tfcompose: allow TF401 because …``, in XML ``<!-- tfcompose: allow … -->``.

A comment counts for its own line, or, alone on a line, for the next one. In XML that is the whole tag that begins or
ends on the line, whatever the number of its lines, or, alone on a line, the next tag that opens.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from dataclasses import replace

from tfcompose.findings import Allow, Span

_COMMENT = re.compile(r"#\s*tfcompose:\s*allow\b(?P<codes>[\sA-Z0-9,]*?)(?:\bbecause\b(?P<reason>[^#]*))?(?:#.*)?$")
_XML = re.compile(r"\s*tfcompose:\s*allow\b(?P<codes>[\sA-Z0-9,]*?)(?:\bbecause\b(?P<reason>.*))?\s*", re.DOTALL)
#: What begins with ``<``, as one piece; tags that open, and comments, are told apart.
_MARKUP = re.compile(
    r"<!--(?P<comment>.*?)-->|<!\[CDATA\[.*?\]\]>|<\?.*?\?>"
    r"|(?P<tag><[^\s<>\"'/!?](?:[^<>\"']|\"[^\"]*\"|'[^']*')*>)|<",
    re.DOTALL,
)
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


def allows_in_xml(text: str, file: str) -> tuple[Allow, ...]:
    """Return the comments in an XML file's text."""
    if "tfcompose:" not in text:
        return ()
    starts = [0, *(found.end() for found in re.finditer("\r\n|\r|\n", text))]
    found: list[Allow] = []
    waiting: list[int] = []  # comments that stand alone, and wait for the tag that they are about
    tag = (0, 0)  # the first and the last line of the last tag that opened
    for markup in _MARKUP.finditer(text):
        if markup["comment"] is None:
            if markup["tag"]:
                tag = (bisect_right(starts, markup.start()), bisect_right(starts, markup.end() - 1))
                for index in waiting:
                    found[index] = replace(found[index], line=tag[0], last=tag[1])
            waiting.clear()
            continue
        match = _XML.fullmatch(markup["comment"])
        if match is None:
            continue
        at = _span(file, starts, markup.start(), markup.end())
        alone = not text[starts[at.line - 1] : markup.start()].strip()
        if alone:
            waiting.append(len(found))
        first, last = (at.end_line + 1, 0) if alone else tag if tag[1] == at.line else (at.line, 0)
        reason = " ".join((match["reason"] or "").split())
        found.append(Allow(tuple(_CODE.findall(match["codes"])), first, reason, at, last))
    return tuple(found)


def _span(file: str, starts: list[int], begin: int, end: int) -> Span:
    line, end_line = bisect_right(starts, begin), bisect_right(starts, end)
    return Span(file, line, begin - starts[line - 1] + 1, end_line, end - starts[end_line - 1] + 1)
