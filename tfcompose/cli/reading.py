"""Text of files on the command line, and lines of files for quotes in findings."""

from __future__ import annotations

import contextlib
import re
import sys
from functools import cache

from tfcompose.foundation.findings import RejectedError, Span, finding
from tfcompose.foundation.reading import MOST_BYTES, no_text, read_bytes

#: The name for standard input.
STDIN = "-"
#: Two patterns for files that findings may quote: XML, and other files about robots (parameters,
#: calibrations, plans, launch files).
_XML = re.compile(r"<(?:robot|launch|package|sdf)\b|<xacro:|xmlns:xacro")
_OTHERS = re.compile(
    r"\bros__parameters[\"']?\s*:"
    r"|^\s*[\"']?(?:T_cn_cnm1|T_cam_imu|transform|camera_matrix)[\"']?\s*:"
    r"|\"spec_digest\"\s*:|^launch\s*:|\bgenerate_launch_description\b",
    re.MULTILINE,
)


def read_text(path: str) -> str:
    """Return the file's text. The name ``-`` is standard input, which is read only once.

    Raises:
        RejectedError: if the file cannot be read, is not text, or is too large; with a finding
            TF001 or TF008.
    """
    data = _standard_input() if path == STDIN else read_bytes(path)
    if len(data) > MOST_BYTES:
        raise RejectedError(
            [finding("TF008", f"the file is larger than {MOST_BYTES:,} bytes", Span(path))]
        )
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        return _decode_as_declared(path, data, error)


@cache
def _standard_input() -> bytes:
    return sys.stdin.buffer.read(MOST_BYTES + 1)


def _decode_as_declared(path: str, data: bytes, error: UnicodeDecodeError) -> str:
    """Return the text of a URDF file in the encoding that the file declares.

    The encoding of other files, such as xacro, must be UTF-8.
    """
    is_urdf = path.endswith(".urdf")
    declared = is_urdf and re.match(
        rb"""<\?xml\b[^>]*\bencoding\s*=\s*["']([A-Za-z][\w.-]*)""", data
    )
    if declared:
        with contextlib.suppress(LookupError, UnicodeDecodeError):
            return data.decode(declared[1].decode())
    advice = "save it as UTF-8"
    if is_urdf:
        advice += (
            ', or declare its encoding in the first line: <?xml version="1.0"'
            ' encoding="ISO-8859-1"?>'
        )
    raise no_text(path, data, error, advice) from None


_quoted: set[str] = set()
_withheld: set[str] = set()


def quote(file: str) -> None:
    """Allow ``line_of`` to quote a file with any content.

    The user has named the file for a command that reads such files.
    """
    _quoted.add(file)


def withhold(file: str) -> None:
    """Forbid ``line_of`` to quote a file that must not be read."""
    _withheld.add(file)


@cache
def _lines(file: str) -> list[str]:
    try:
        text = read_text(file)
    except RejectedError:
        return []
    return text.splitlines() if file in _quoted or _is_of_a_robot(text) else []


def _is_of_a_robot(text: str) -> bool:
    """Return whether the text belongs to a robot.

    Other files can contain passwords, and lint's output may be public.
    """
    if text.lstrip().startswith("<"):
        return _XML.search(text) is not None
    if "\0" in text:
        return False
    if _OTHERS.search(text):
        return True
    from tfcompose.spec.language.recognition import is_recognized  # importing pydantic is slow

    return is_recognized(text)


def forget_lines() -> None:
    """Clear the cache of ``line_of``."""
    _lines.cache_clear()


def line_of(file: str, line: int) -> str | None:
    """Return a line of a file, counted from 1.

    Return None if there is no such line, or if the file must not be quoted.
    """
    if file in _withheld:
        return None
    lines = _lines(file)
    return lines[line - 1] if 0 < line <= len(lines) else None
