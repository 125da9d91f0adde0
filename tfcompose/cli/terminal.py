"""What all commands share: reading files, and printing findings."""

from __future__ import annotations

import os
import re
import stat
import sys
from contextlib import suppress
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING

from tfcompose.findings import Finding, RejectedError, Span, finding
from tfcompose.render.text import render_text

if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import TextIO

UNREADABLE = 2
MOST_BYTES = 16_000_000

#: Pipes that the shell has opened. One with a name would be waited for until somebody writes to it.
_OPEN_ALREADY = ("/dev/fd/", "/dev/stdin", "/proc/")


def read_text(path: str) -> str:
    """Return the file's text.

    Raises:
        RejectedError: with one TF001 or TF008 finding, if it cannot be read, is no text, or is too large.
    """
    try:
        if stat.S_ISFIFO(os.stat(path).st_mode) and not path.startswith(_OPEN_ALREADY):
            raise RejectedError([finding("TF001", "cannot be read: it is a pipe, not a file", Span(path))])
        with open(path, "rb") as file:
            data = file.read(MOST_BYTES + 1)
    except OSError as error:
        raise RejectedError([_unreadable(path, error)]) from None
    except ValueError:
        raise RejectedError([finding("TF001", "a file name cannot hold a NUL byte", Span("?"))]) from None
    if len(data) > MOST_BYTES:
        raise RejectedError([finding("TF008", f"the file is larger than {MOST_BYTES:,} bytes", Span(path))])
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        return _declared(path, data, error)


def _declared(path: str, data: bytes, error: UnicodeDecodeError) -> str:
    """Return the text of a URDF in the encoding that it declares; xacro reads UTF-8 whatever a file says."""
    is_urdf = path.endswith(".urdf")
    said = is_urdf and re.match(rb"""<\?xml\b[^>]*\bencoding\s*=\s*["']([A-Za-z][\w.-]*)""", data)
    if said:
        with suppress(LookupError, UnicodeDecodeError):
            return data.decode(said[1].decode())
    before = data[: error.start]
    line, column = before.count(b"\n") + 1, error.start - before.rfind(b"\n")
    message = f"not a text file: byte 0x{data[error.start]:02x} is not UTF-8"
    advice = "save it as UTF-8"
    if is_urdf:
        advice += ', or say in its first line what it is: <?xml version="1.0" encoding="ISO-8859-1"?>'
    place = Span(path, line, column, line, column + 1)
    raise RejectedError([finding("TF001", message, place, help=advice)]) from None


def _unreadable(path: str, error: OSError) -> Finding:
    advice = ""
    if isinstance(error, FileNotFoundError):
        folder = import_module("pathlib").Path(path).parent
        ending = next((one for one in (".urdf", ".xacro") if path.endswith(one)), ".yaml")
        there = sorted(file.name for file in folder.glob(f"*{ending}")) if folder.is_dir() else []
        advice = f"in {folder} there is {', '.join(there[:8])}" if there else f"there is no {ending} file in {folder}"
    elif isinstance(error, IsADirectoryError):
        advice = "no robot file is in it: name one"
    return finding("TF001", f"cannot be read: {error.strerror}", Span(path), help=advice)


def unreadable(found: Sequence[Finding]) -> bool:
    """Return whether the findings say that a file cannot be read at all."""
    return any(one.code == "TF001" for one in found)


def print_findings(found: Sequence[Finding], stream: TextIO) -> None:
    """Print findings for people, with the lines that they are about."""
    stream.write(render_text(found, line_of, colour=coloured(stream)))


def coloured(stream: TextIO) -> bool:
    """Return whether to colour: on a terminal, unless NO_COLOR is set (no-color.org)."""
    return draws(stream) and not os.environ.get("NO_COLOR")


def draws(stream: TextIO) -> bool:
    """Return whether lines can be drawn again in their place: on a terminal that can do more than print."""
    return stream.isatty() and os.environ.get("TERM") != "dumb"


@cache
def _lines(file: str) -> list[str]:
    try:
        return read_text(file).splitlines()
    except RejectedError:
        return []


def line_of(file: str, line: int) -> str | None:
    """Return a line of a file, counted from 1, or None."""
    lines = _lines(file)
    return lines[line - 1] if 0 < line <= len(lines) else None


def complain(message: str) -> None:
    """Print one sentence about wrong use to stderr."""
    sys.stderr.write(f"tfcompose: {message}\n")
