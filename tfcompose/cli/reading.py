"""Files of this machine as text, with findings about what cannot be read."""

from __future__ import annotations

import contextlib
import re
import sys
from functools import cache
from pathlib import Path

from tfcompose.foundation.findings import Finding, RejectedError, Span, finding

MOST_BYTES = 16_000_000
#: Of files with another ending than these, the robot files are named that are there in their
#: place.
_ENDINGS = (".urdf", ".xacro", ".launch", ".py", ".xml", ".sh", ".bash")
#: The name of standard input.
STDIN = "-"

#: Pipes that the shell has opened. One with a name would block until it is written to.
_OPEN_ALREADY = ("/dev/fd/", "/dev/stdin", "/proc/")


def read_text(path: str) -> str:
    """Return the file's text; ``-`` is standard input, which is read once.

    Raises:
        RejectedError: with one TF001 or TF008 finding, if it cannot be read, is no text, or is too
            large.
    """
    file = Path(path)
    try:
        if file.is_fifo() and not path.startswith(_OPEN_ALREADY):
            raise RejectedError(
                [finding("TF001", "cannot be read: it is a pipe, not a file", Span(path))]
            )
        if path == STDIN:
            data = _standard_input()
        else:
            with file.open("rb") as stream:
                data = stream.read(MOST_BYTES + 1)
    except OSError as error:
        raise RejectedError([_unreadable(path, error)]) from None
    except ValueError:
        raise RejectedError(
            [finding("TF001", "a file name cannot hold a NUL byte", Span("?"))]
        ) from None
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
    """Return the text of a URDF in the encoding that it declares; xacro reads UTF-8 whatever a file says."""
    is_urdf = path.endswith(".urdf")
    declared = is_urdf and re.match(
        rb"""<\?xml\b[^>]*\bencoding\s*=\s*["']([A-Za-z][\w.-]*)""", data
    )
    if declared:
        with contextlib.suppress(LookupError, UnicodeDecodeError):
            return data.decode(declared[1].decode())
    before = data[: error.start]
    line, column = before.count(b"\n") + 1, error.start - before.rfind(b"\n")
    message = f"not a text file: byte 0x{data[error.start]:02x} is not UTF-8"
    advice = "save it as UTF-8"
    if is_urdf:
        advice += (
            ', or declare its encoding in the first line: <?xml version="1.0"'
            ' encoding="ISO-8859-1"?>'
        )
    place = Span(path, line, column, line, column + 1)
    raise RejectedError([finding("TF001", message, place, help=advice)]) from None


def _unreadable(path: str, error: OSError) -> Finding:
    advice = ""
    if isinstance(error, FileNotFoundError):
        folder = Path(path).parent
        ending = next((one for one in _ENDINGS if path.endswith(one)), ".yaml")
        there = sorted(file.name for file in folder.glob(f"*{ending}")) if folder.is_dir() else []
        advice = (
            f"in {folder} there is {', '.join(there[:8])}"
            if there
            else f"there is no {ending} file in {folder}"
        )
    elif isinstance(error, IsADirectoryError):
        advice = "name a file in it"
    return finding("TF001", f"cannot be read: {error.strerror}", Span(path), help=advice)


@cache
def _lines(file: str) -> list[str]:
    try:
        return read_text(file).splitlines()
    except RejectedError:
        return []


def forget_lines() -> None:
    """Let ``line_of`` read files anew."""
    _lines.cache_clear()


def line_of(file: str, line: int) -> str | None:
    """Return a line of a file, counted from 1, or None."""
    lines = _lines(file)
    return lines[line - 1] if 0 < line <= len(lines) else None
